# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of interpolation between two samples: on a curve, and at a jump."""

from collections.abc import Sequence
from functools import partial
from math import dist, radians, sin, sqrt, tau
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry.se3 import distance_many
from tf_tree_py.core.stamp import as_seconds, from_seconds

from .latency import Motion, pose_at
from .report import Axes, Column, Figure, GREY, name_ticks, note, Report, STYLES, Table

SUMMARY = 'between samples a curve is cut by a T^2/8; a jump invents poses'

SPEED = 0.5
_TURN_RATES = (0.5, 1.0, 2.0)
RATES_HZ = (5.0, 10.0, 20.0, 50.0, 100.0)
_SWING, _SWING_HZ = 0.5, 1.0
_SAMPLES = 60
_PER_GAP = 8

JUMP = Pose.from_xyz_rpy(y=0.5, yaw=radians(10.0))
"""The jump of a localiser that publishes at 10 Hz."""
_JUMP_PERIOD = from_seconds(0.1)
_JUMP_AT = from_seconds(1.0)


class Gap(NamedTuple):
    """The largest errors between samples, in metres and radians."""

    rate_hz: float
    moved: float
    turned: float


def between_samples(motion: Motion, rate_hz: float) -> Gap:
    """Sample a motion at a rate, and look up poses between the samples."""
    period = from_seconds(1.0 / rate_hz)
    buffer = BufferCore(cache_time=_SAMPLES * period)
    for number in range(1, _SAMPLES):
        buffer.insert('odom', 'base_link', number * period, motion(number * period))
    stamps = [period + period * number // _PER_GAP for number in range(_PER_GAP * (_SAMPLES - 2))]
    found = np.asarray(buffer.lookup_many('odom', 'base_link', stamps))
    truth = np.array([motion(stamp) for stamp in stamps])
    moved, turned = distance_many(truth, found)
    return Gap(rate_hz, float(moved.max()), float(turned.max()))


def swing(stamp: int) -> Pose:
    """Return the pose of a head that turns left and right once a second, by half a radian."""
    return Pose.from_xyz_rpy(yaw=_SWING * sin(tau * _SWING_HZ * as_seconds(stamp)))


def rate_for(acceleration: float, error: float) -> float:
    """
    Return the publishing rate, Hz, that keeps the error between samples below a limit.

    :param acceleration: the largest of the motion, in m/s^2 (on a curve: speed times
        angular velocity) or rad/s^2.
    :param error: the limit, in metres or radians.
    """
    return sqrt(acceleration / (8.0 * error))


def fit(gaps: list[Gap]) -> tuple[float, float]:
    """Return (k, n) of error = k T^n: a line through the logarithms."""
    power, logarithm = np.polyfit(np.log([1.0 / gap.rate_hz for gap in gaps]),
                                  np.log([gap.moved for gap in gaps]), 1)
    return float(np.exp(logarithm)), float(power)


class Invented(NamedTuple):
    """A lookup between the last sample before a jump and the first after it."""

    ratio: float
    from_before: float
    from_after: float


_RATIOS = (0.0, 0.25, 0.5, 0.75, 1.0)


def invented(*, sent_before: bool, ratios: Sequence[float] = _RATIOS) -> list[Invented]:
    """
    Look up map_T_odom across a jump.

    :param sent_before: whether the old pose is sent once more, 1 ns before the jump.
    :param ratios: the times of the lookups: 0 is the last sample before the jump, 1 the
        first after it.
    """
    buffer = BufferCore()
    before = Pose()
    buffer.insert('map', 'odom', _JUMP_AT - _JUMP_PERIOD, before)
    if sent_before:
        buffer.insert('map', 'odom', _JUMP_AT - 1, before)
    buffer.insert('map', 'odom', _JUMP_AT, JUMP)
    found = []
    for ratio in ratios:
        stamp = _JUMP_AT - round((1.0 - ratio) * _JUMP_PERIOD)
        pose = buffer.lookup('map', 'odom', stamp)
        found.append(Invented(ratio, dist(pose.translation, before.translation),
                              dist(pose.translation, JUMP.translation)))
    return found


def run() -> Report:
    """Look up poses between samples of a curve, of a swinging head, and of a jump."""
    curves = {rate: [between_samples(partial(pose_at, SPEED, rate), hz) for hz in RATES_HZ]
              for rate in _TURN_RATES}
    swings = [between_samples(swing, hz) for hz in RATES_HZ]
    factor, power = fit(curves[1.0])
    eighth = factor / SPEED
    middle = invented(sent_before=False)[2]
    return Report(
        tables=[_curve_table(curves), _swing_table(swings), _rate_table(), _jump_table()],
        law=f'between samples T apart a straight line is off by at most a T^2/8, with a the '
            f'acceleration, v w on a curve (fitted: {eighth:.4f} v w T^{power:.3f}), so publish '
            'at sqrt(a / (8 error)) Hz; and at a jump it invents poses as far as '
            f'{min(middle[1:]) * 100.0:.0f} cm from anywhere the frame ever was.',
        remarks=['Rotation at a constant rate is exact at any publishing rate, because slerp is '
                 'that motion. Slerp misses changes of the rate.'],
        numbers={'factor': eighth, 'power': power, 'rate_for_1mm_hz': rate_for(SPEED, 0.001),
                 'invented_m': min(middle[1:])},
        draw=partial(_draw, curves))


def _curve_table(curves: dict[float, list[Gap]]) -> Table:
    return Table(
        f'On a curve at {SPEED} m/s: the largest error between samples',
        (Column('turn_rate', 'w [rad/s]', '.1f'), Column('rate_hz', 'rate [Hz]', '.0f'),
         Column('moved_m', 'off by [mm]', '.4f'), Column('law_m', 'v w T^2/8 [mm]', '.4f'),
         Column('turned_rad', 'turned [deg]', '.4f')),
        [(rate, gap.rate_hz, gap.moved, SPEED * rate / gap.rate_hz ** 2 / 8.0, gap.turned)
         for rate, gaps in curves.items() for gap in gaps])


def _swing_table(swings: list[Gap]) -> Table:
    acceleration = _SWING * (tau * _SWING_HZ) ** 2
    return Table(
        f'A head that swings by {_SWING} rad at {_SWING_HZ:g} Hz: {acceleration:.1f} rad/s^2',
        (Column('rate_hz', 'rate [Hz]', '.0f'),
         Column('turned_rad', 'turned wrongly [deg]', '.3f'),
         Column('law_rad', 'acceleration T^2/8 [deg]', '.3f')),
        [(gap.rate_hz, gap.turned, acceleration / gap.rate_hz ** 2 / 8.0) for gap in swings])


def _rate_table() -> Table:
    rows = []
    for name, speed, turn_rate in (('warehouse robot', 0.5, 0.5), ('forklift', 2.0, 1.0),
                                   ('arm', 1.5, 3.0), ('racing drone', 15.0, 4.0)):
        rate = rate_for(speed * turn_rate, 0.001)
        gap = between_samples(partial(pose_at, speed, turn_rate), rate)
        rows.append((name, speed, turn_rate, rate, gap.moved))
    return Table(
        'How often to publish for 1 mm: sqrt(v w / (8 error)); and the resulting error',
        (Column('what', 'what'), Column('speed', 'v [m/s]', '.1f'),
         Column('turn_rate', 'w [rad/s]', '.1f'), Column('rate_hz', 'rate [Hz]', '.1f'),
         Column('moved_m', 'off by [mm]', '.3f')), rows)


def _jump_table() -> Table:
    rows = []
    for plain, cured in zip(invented(sent_before=False), invented(sent_before=True), strict=True):
        rows.append((plain.ratio * as_seconds(_JUMP_PERIOD), plain.from_before, plain.from_after,
                     cured.from_before))
    return Table(
        f'map -> odom jumps by {JUMP.y} m, {_JUMP_PERIOD / 1e6:.0f} ms after its last sample',
        (Column('after_s', 'after that sample [ms]', '.0f'),
         Column('from_before_m', 'from where it was [cm]', '.1f'),
         Column('from_after_m', 'from where it will be [cm]', '.1f'),
         Column('told_from_before_m', 'the same, old pose sent again [cm]', '.1f')),
        rows)


def _draw(curves: dict[float, list[Gap]], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    for style, (rate, gaps) in zip(STYLES[1:], curves.items(), strict=True):
        left.loglog([gap.rate_hz for gap in gaps], [gap.moved * 1e3 for gap in gaps],
                    color=style['color'], marker=style['marker'], linestyle=style['linestyle'],
                    label=f'ω = {rate:g} rad/s')
    left.axhline(1.0, color=GREY, linewidth=1.0)
    note(left, '1 mm', (100.0, 1.0), (0, 3), ha='right', color=GREY)
    left.set(xlabel='publishing rate [Hz]', ylabel='largest error between samples [mm]',
             title=f'A curve at {SPEED} m/s: error = v ω T² / 8')
    name_ticks(left, RATES_HZ)
    left.legend(loc='lower left')
    _draw_jump(right)


def _draw_jump(axes: Axes) -> None:
    """Draw the answers of lookups during a correction by a localiser."""
    period, height = _JUMP_PERIOD / 1e6, JUMP.y * 100.0
    axes.plot([-2.0 * period, 0.0, 0.0, period], [0.0, 0.0, height, height], color=GREY,
              linewidth=6.0, alpha=0.4, label="the localiser's pose")
    axes.plot([-2.0 * period, -period, 0.0, period], [0.0, 0.0, height, height], **STYLES[0],
              label='samples at 10 Hz, and lookups')
    just_before = 1.0 - 1.0 / _JUMP_PERIOD
    cured = invented(sent_before=True, ratios=(0.0, just_before, 1.0))
    axes.plot([(found.ratio - 1.0) * period for found in cured],
              [found.from_before * 100.0 for found in cured], color=STYLES[1]['color'],
              linestyle='--', label='lookups with the remedy')
    axes.plot(0.0, 0.0, color=STYLES[1]['color'], marker='s', markersize=8.0, fillstyle='none',
              linestyle='none', markeredgewidth=1.8)
    note(axes, 'invented:\nit was never here', (-0.5 * period, height / 2.0), (-105, 8),
         arrowprops={'arrowstyle': '->'})
    note(axes, 'the remedy:\nthe old pose\nonce more', (0.0, 0.0), (18, 30),
         color=STYLES[1]['color'],
         arrowprops={'arrowstyle': '->', 'color': STYLES[1]['color'], 'shrinkB': 6.0})
    axes.set(xlabel='time, from the jump [ms]', ylabel='odom in map: y [cm]',
             ylim=(-5.0, 80.0), title='A jump of map → odom, published at 10 Hz')
