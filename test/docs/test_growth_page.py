# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page of growing work has all sizes that the benchmark measures, and the plot reads them."""

import operator
from pathlib import Path

from benchmark import growth_plot, plots, stored
from benchmark.groups import growth, growth_processes
from benchmark.rows import OURS
import pytest

DOCS = Path(__file__).parents[2] / 'docs'
SIZES = {'growth_samples': growth.SAMPLES, 'growth_frames': growth.FRAMES,
         'growth_threads': growth.THREADS, 'growth_memory': growth.SAMPLES,
         'growth_rates': growth_processes.RATES_HZ, 'growth_bags': growth_processes.BAGS}


@pytest.fixture(scope='module')
def rows():
    return [row for row in stored.results_of(DOCS).rows if row.group in SIZES]


def test_page_has_all_sizes(rows):
    assert {panel.group for panel in growth_plot.PANELS} == set(SIZES)
    for panel in growth_plot.PANELS:
        points = list(growth_plot.points_of(rows, panel))
        assert tuple(size for size, _ in points) == SIZES[panel.group], panel
        assert all(OURS in values for _, values in points), panel


def test_every_panel_of_the_plot_has_its_lines_and_axes(rows):
    pytest.importorskip('matplotlib').use('Agg')
    drawn = growth_plot.figure(rows, plots.LOOKS, plots.LONG_NAMES)
    for axes, panel in zip(drawn.axes, growth_plot.PANELS, strict=True):
        points = list(growth_plot.points_of(rows, panel))
        contestants = {name for _, values in points for name in values}
        assert len(axes.lines) == len(contestants & set(growth_plot.ORDER)) > 0, panel
        assert axes.get_xlabel() and axes.get_ylabel(), panel
        # A cell of a table has the median, the least and the greatest.
        drawn_of = {'median': operator.itemgetter(0), 'least': min, 'greatest': max}[panel.part]
        drawn_values = [drawn_of(row.values[OURS]) for row in rows if row.group == panel.group
                        and row.name.startswith(f'{panel.quantity}, ')]
        assert axes.lines[0].get_ydata().tolist() == drawn_values, panel
        # No value lies outside its panel.
        low, high = axes.get_ylim()
        assert all(low <= value <= high for line in axes.lines for value in line.get_ydata())


def test_without_such_rows_there_is_no_plot():
    assert growth_plot.figure([], {}, {}) is None
