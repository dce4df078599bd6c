# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture of a calibration: the error of each observation against speed and time."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from tf_tree_py.calibration import Calibration, Verdict
from tf_tree_py.calibration.observations import Array
from tf_tree_py.command.endings import Cannot, needs

from .report import SENTENCES

SUFFIXES = ('.png', '.svg', '.pdf')
_BEFORE = {'color': '#c84c00', 'marker': 'x', 'linestyle': '', 'markersize': 4.0}
_AFTER = {'color': '#0060a8', 'marker': '.', 'linestyle': '', 'markersize': 4.0}


def write_picture(found: Calibration, path: Path) -> None:
    """
    Draw the error of each observation before and after the calibration.

    :raises Cannot: matplotlib is not installed, or the file cannot be written.
    """
    figure = needs('matplotlib.figure', 'matplotlib').Figure(
        figsize=(9.0, 4.0), dpi=110, layout='constrained')
    draw(found, figure)
    try:
        figure.savefig(path)
    except OSError as error:
        raise Cannot(f'{path} cannot be written: {error.strerror}') from error


def draw(found: Calibration, figure: Any) -> None:
    """Draw into a matplotlib ``Figure``."""
    by_speed, over_time = figure.subplots(1, 2, sharey=True)
    trace = found.trace
    seconds = (trace.stamps - trace.stamps[0]) / 1e9
    for axes, places in ((by_speed, trace.speed), (over_time, seconds)):
        axes.plot(places, 1e3 * trace.before_m, label=_label('before', trace.before_m), **_BEFORE)
        axes.plot(places, 1e3 * trace.after_m, label=_label('after', trace.after_m), **_AFTER)
        axes.grid(color='#dcdcdc')
        axes.set_axisbelow(True)
        axes.spines[['top', 'right']].set_visible(False)
    top = np.percentile(np.concatenate([trace.before_m, trace.after_m]), 99.0)
    by_speed.set(xlabel='speed of the target past the sensor [m/s]',
                 ylabel="error of the target's position [mm]",
                 ylim=(0.0, 1.1e3 * max(float(top), 1e-6)),
                 title='Against speed: errors of late stamps grow')
    over_time.set(xlabel='time [s]', title='Along the recording')
    figure.legend(*by_speed.get_legend_handles_labels(), loc='outside lower center', ncols=2)
    figure.suptitle(_headline(found), fontweight='bold')


def _label(name: str, errors: Array) -> str:
    return f'{name}: half are within {1e3 * float(np.median(errors)):.2g} mm'


def _headline(found: Calibration) -> str:
    """Return the verdict, and the size of each error."""
    parts = list[str]()
    if found.wants_new_edge:
        parts += [f'{each.parent} -> {each.child} is off by {1e3 * each.moved_m:.0f} mm and '
                  f'{math.degrees(each.turned_rad):.1f} deg' for each in found.edges]
    if found.verdict in (Verdict.TIME, Verdict.BOTH):
        parts += [f'the stamps of {each.sensor} are {1e3 * abs(each.offset_s):.0f} ms '
                  f'{"late" if each.offset_s >= 0 else "early"}' for each in found.time_offsets]
    return '\n'.join(filter(None, [SENTENCES[found.verdict], '; '.join(parts)]))
