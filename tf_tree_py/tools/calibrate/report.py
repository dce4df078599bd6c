# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A calibration in words for a terminal, as YAML for ``static_transform_publisher``, as a picture.

The picture shows the error of each observation against speed and time.
"""

from collections.abc import Sequence
import math
from pathlib import Path
from typing import Any

import numpy as np
from tf_tree_py.calibration import (
    Calibration,
    EdgeEstimate,
    Explanation,
    TimeOffset,
    Unobservable,
    Verdict,
)
from tf_tree_py.calibration.at_rest import NOT_AT_REST
from tf_tree_py.calibration.observations import Array
from tf_tree_py.command.arguments import console, fields, styled, table
from tf_tree_py.command.endings import cannot_be, needs

_SENTENCES = {
    Verdict.NOTHING: 'Nothing is wrong: no other mounting or time offset explains the '
                     'observations better.',
    Verdict.EDGE: 'The mounting is wrong, and the stamps are right.',
    Verdict.TIME: 'The stamps are wrong, and the mounting is right.',
    Verdict.BOTH: 'The mounting is wrong, and the stamps are wrong.',
    Verdict.UNKNOWN: 'The observations do not show what is wrong.',
}
"""What each verdict means."""
_COLUMNS = ('explanation', 'error left, mm', 'error left, deg', 'offset, ms', 'criterion')
_MOST = 5


def print_report(found: Calibration, time: bool) -> None:
    """Print the verdict, the estimates, and what to do next."""
    out = console()
    what = 'fine' if found.verdict is Verdict.NOTHING else 'warning'
    out.print(styled(f'{found.verdict}: {_sentence_of(found)}', what))
    out.print(table(_COLUMNS, [_row(each, found.explanations) for each in found.explanations],
                    right=_COLUMNS[1:]))
    if found.contradiction is None:
        _print_estimate(found)
    else:
        out.print(fields({'reason': found.contradiction.what}))
    for sentence in advice(found, time):
        out.print(fields({'next': sentence}))


def _print_estimate(found: Calibration) -> None:
    out = console()
    for edge in found.edges:
        out.print(fields({'edge': f'{edge.parent} -> {edge.child}', 'before': str(edge.before),
                          'after': str(edge.after), 'change': _moved(edge),
                          'sigma': _sigmas(edge)}))
    for offset in found.time_offsets:
        out.print(fields({'time': _late(offset)}))
    for sentence in hidden(found):
        out.print(fields({'not seen': sentence}))
    _print_outliers(found)


def _sentence_of(found: Calibration) -> str:
    """Return what the verdict means."""
    if found.contradiction is not None:
        return f'{NOT_AT_REST[0].upper()}{NOT_AT_REST[1:]}.'
    return _SENTENCES[found.verdict]


def _row(each: Explanation, all_of_them: Sequence[Explanation]) -> tuple[str, ...]:
    best = min(other.criterion for other in all_of_them)
    turned = '-' if math.isnan(each.unexplained_rad) else (
        f'{math.degrees(each.unexplained_rad):.3f}')
    return (str(each.name), f'{1e3 * each.unexplained_m:.2f}', turned,
            ', '.join(f'{1e3 * offset + 0.0:.1f}' for offset in each.offsets),
            f'+{each.criterion - best:.1f}')


def _moved(edge: EdgeEstimate) -> str:
    return f'{1e3 * edge.moved_m:.2f} mm, {math.degrees(edge.turned_rad):.3f} deg'


def _sigmas(edge: EdgeEstimate) -> str:
    sigmas = np.sqrt(np.diag(edge.covariance))
    moved = ', '.join(f'{1e3 * each:.2g}' for each in sigmas[:3])
    turned = ', '.join(f'{math.degrees(each):.2g}' for each in sigmas[3:])
    return f'{moved} mm along x, y, z; {turned} deg about x, y, z'


def _late(offset: TimeOffset) -> str:
    jitter = f', and jitter by {1e3 * offset.jitter_s:.1f} ms' if offset.jitter_s else ''
    return (f'the stamps of {offset.sensor} are {1e3 * abs(offset.offset_s):.2f} ms '
            f'{"late" if offset.offset_s >= 0 else "early"} '
            f'(sigma {1e3 * offset.sigma_s:.2f} ms){jitter}')


def _print_outliers(found: Calibration) -> None:
    if not found.outliers:
        return
    first = ', '.join(f'{each.stamp // 10**9}.{each.stamp % 10**9:09d}'
                      for each in found.outliers[:_MOST])
    more = f' and {len(found.outliers) - _MOST} more' if len(found.outliers) > _MOST else ''
    console().print(fields({'outliers': f'{len(found.outliers)} of {found.observations}: '
                            f'{first}{more}'}))


def hidden(found: Calibration) -> list[str]:
    """
    Return a sentence for each direction that is not observable; one if none is observable.

    If the observations do not fit one target at rest, no motion of the robot would help.
    """
    if found.contradiction is not None:
        return []
    if found.all_at_one_place:
        parents = ' and '.join(dict.fromkeys(edge.parent for edge in found.edges))
        return ['all observations are from one place, so they show neither the mounting nor the '
                f'time: turn {parents} about two axes, move at several speeds, and record again']
    return list(dict.fromkeys(
        _hidden(each, bool(found.time_offsets)) for each in found.unobservable))


def _hidden(each: Unobservable, time: bool) -> str:
    if each.product_with is not None:
        return (f'{each.what}: {each.remedy}. Here, {each.parent} -> {each.child} keeps the '
                "tree's value")
    as_right = each.kind == 'time' or (each.kind == 'both' and not time)
    kept = 'the stamps count as right' if as_right else "it keeps the tree's value"
    return f'{each.what}: {kept}. To see it, {each.remedy}'


def advice(found: Calibration, time: bool) -> list[str]:
    """Return what to do next, a sentence each."""
    if found.contradiction is not None:
        return [found.contradiction.remedy]
    bounds = [_larger(each) for each in found.time_offsets if each.at_bound]
    if bounds:
        return bounds
    if found.verdict is Verdict.UNKNOWN:
        missing = any(each.product_with is None for each in found.unobservable)
        return ['record again, with the motion that is missing'] if missing else [
            'record longer, and at several speeds: a wrong mounting and wrong stamps explain '
            'these observations equally well']
    said = []
    if found.verdict in (Verdict.TIME, Verdict.BOTH):
        said += _corrections(found)
        if not time:
            said.append('add --time: without it, the edge is estimated as if the stamps were '
                        'right')
    if found.wants_new_edge and (time or found.verdict is Verdict.EDGE):
        said.append('use the new edge: -o edge.yaml writes it for static_transform_publisher '
                    '--yaml, and --write robot.urdf into a robot description')
    return said


def _corrections(found: Calibration) -> list[str]:
    offsets = next(each.offsets for each in found.explanations if each.name is found.verdict)
    sensors = [each.sensor for each in found.time_offsets] or ['the sensor'] * len(offsets)
    return [f'{"subtract" if late > 0 else "add"} {1e3 * abs(late):.1f} ms '
            f'{"from" if late > 0 else "to"} the stamps of {sensor} in its driver; until then, '
            f'look up transforms at the stamp {"minus" if late > 0 else "plus"} '
            f'{1e3 * abs(late):.1f} ms' for sensor, late in zip(sensors, offsets, strict=True)]


def _larger(offset: TimeOffset) -> str:
    return (f'try again with a larger --max-offset: the time of {offset.sensor} is at the bound '
            f'of {abs(offset.offset_s):.3g} s, so the true offset may be larger and the edge '
            'wrong. The transforms must begin that much before the observations, and end that '
            'much after them')


def as_yaml(found: Calibration) -> str:
    """Return the edges as a file for ``static_transform_publisher --yaml``."""
    lines = ['transforms:']
    for edge in found.edges:
        numbers = ', '.join(f'{name}: {float(value):.12g}' for name, value in zip(
            ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'), edge.after, strict=True))
        covariance = ', '.join(_float(value) for value in edge.covariance.ravel())
        lines.append(f'  - {{frame_id: {_quoted(edge.parent)}, child_frame_id: '
                     f'{_quoted(edge.child)}, {numbers}, covariance: [{covariance}]}}')
    return '\n'.join(lines) + '\n'


def _float(value: float) -> str:
    """Return a number that YAML reads as a number: 1e-6 needs a decimal point."""
    mantissa, e, exponent = f'{float(value):.9g}'.partition('e')
    return f'{mantissa}{"" if "." in mantissa or not e else ".0"}{e}{exponent}'


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"


# --- the picture

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
    with cannot_be('written', path):
        figure.savefig(path)


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
    return '\n'.join(filter(None, [_sentence_of(found), '; '.join(parts)]))
