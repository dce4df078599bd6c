# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The plot of the cost as the work grows: a small panel for each quantity."""

from collections.abc import Iterator, Mapping, Sequence
import math
import re
from typing import Any, NamedTuple

from .rows import DEBIAN, JAZZY, OURS, PLAIN, RAW, Row, TF2_ROS
from .timing import spread

# Further contestants; those of all plots have the looks of the other plots.
_LOOKS: dict[str, dict[str, Any]] = {
    PLAIN: {'color': '0.35', 'linestyle': (0, (4, 2, 1, 2)), 'marker': 'x'},
    RAW: {'color': '0.35', 'linestyle': (0, (1, 1)), 'marker': '+'},
}
_LONG_NAMES = {PLAIN: 'plain rclpy, empty callback', RAW: 'rosbags, raw bytes alone'}
ORDER = (OURS, TF2_ROS, JAZZY, DEBIAN, PLAIN, RAW)


class Panel(NamedTuple):
    """
    One panel.

    :ivar group: of its rows, whose names begin with ``quantity``.
    :ivar logarithmic: whether the values span decades; otherwise their axis begins at zero.
    :ivar part: of the rounds: 'least', 'median' or 'greatest'.
    """

    group: str
    quantity: str
    title: str
    across: str
    up: str
    logarithmic: bool = False
    part: str = 'least'


PANELS = (
    Panel('growth_samples', 'old stamp', 'a lookup at an old stamp', 'samples of each edge',
          'time [µs]', logarithmic=True),
    Panel('growth_samples', 'latest', 'a lookup of the latest', 'samples of each edge',
          'time [µs]'),
    Panel('growth_frames', 'lookup', 'a lookup over five edges', 'frames in the tree',
          'time [µs]'),
    Panel('growth_frames', 'insertion', 'an insertion', 'frames in the tree', 'time [µs]'),
    Panel('growth_frames', 'whole tree', 'all frames at once', 'frames in the tree',
          'time per frame [µs]'),
    Panel('growth_threads', 'in total', 'threads on one buffer', 'threads',
          'lookups per second', part='greatest'),
    Panel('growth_memory', 'in all', 'memory of a sample', 'samples of each edge',
          'bytes per sample'),
    Panel('growth_rates', 'CPU', 'listening to /tf', 'messages per second',
          'CPU [% of a core]', part='median'),
    Panel('growth_bags', 'open each, and a lookup', 'bags opened one by one', 'bags',
          'CPU per bag [ms]'),
)


def figure(rows: Sequence[Row], looks: Mapping[str, Mapping[str, Any]],
           long_names: Mapping[str, str]) -> Any:
    """
    Return the plot; None without rows of these groups.

    :param looks: the line and the marker of each contestant in all plots.
    :param long_names: of the contestants.
    """
    found = {(panel.group, panel.quantity): list(points_of(rows, panel)) for panel in PANELS}
    if not any(found.values()):
        return None
    from matplotlib.figure import Figure
    looks, long_names = {**looks, **_LOOKS}, {**long_names, **_LONG_NAMES}
    drawing = Figure(figsize=(9.0, 7.8), layout='constrained')
    panels = drawing.subplots(3, 3)
    legend = {}
    for axes, panel in zip(panels.flat, PANELS, strict=True):
        points = found[panel.group, panel.quantity]
        for name in ORDER:
            line = [(size, values[name]) for size, values in points if name in values]
            if line:
                [legend[name]] = axes.plot(*zip(*line, strict=True), markersize=4.5,
                                           fillstyle='none' if name != OURS else 'full',
                                           label=long_names.get(name, name), **looks[name])
        if points:
            _axes(axes, panel, [size for size, _ in points])
        else:
            axes.set_axis_off()
    drawing.legend(handles=[legend[name] for name in ORDER if name in legend],
                   loc='outside lower center', ncols=3, frameon=False, fontsize=9)
    return drawing


def points_of(rows: Sequence[Row], panel: Panel) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield each size with this part of the rounds of every contestant."""
    for row in rows:
        named = re.fullmatch(re.escape(panel.quantity) + r', ([\d,]+) \w+', row.name)
        if row.group == panel.group and named:
            yield int(named[1].replace(',', '')), {
                name: getattr(spread(values), panel.part) for name, values in row.values.items()}


def _axes(axes: Any, panel: Panel, sizes: Sequence[int]) -> None:
    axes.set_title(panel.title, fontsize=10)
    axes.set_xlabel(f'{panel.across} (logarithmic)', fontsize=9)
    axes.set_ylabel(panel.up + (', logarithmic' if panel.logarithmic else ''), fontsize=9)
    axes.set_xscale('log')
    axes.set_xticks(sizes, [f'{size:,}' for size in sizes])
    if panel.logarithmic:
        axes.set_yscale('log')
        _whole_decades(axes)
    else:
        axes.set_ylim(bottom=0.0)
    axes.yaxis.set_major_formatter('{x:,g}')
    axes.minorticks_off()
    axes.tick_params(labelsize=8)
    axes.grid(visible=True, color='0.9')


def _whole_decades(axes: Any) -> None:
    """Widen a logarithmic axis to whole decades."""
    low, high = axes.dataLim.intervaly
    axes.set_ylim(10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(1.01 * high)))
