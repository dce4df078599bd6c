# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Continuous time: lookups for an event camera between poses, and the errors of a spline."""

from collections.abc import Callable
from functools import partial
from math import degrees, radians
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.beyond.curves.spline import Spline
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import se3, UNLIMITED
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamps

from .report import Axes, Column, Figure, GREY, name_ticks, Report, STYLES, Table

SUMMARY = 'a spline knows between poses what lerp and slerp cut off; at a jump it rings'

RATES_HZ = (10, 20, 50, 100, 200)
_KNOT_RATES_HZ = (5, 10, 20, 50, 200)
NOISE = (0.001, radians(0.1))
"""The standard deviation of a tracker's poses in each axis, metres and radians."""
_NOISY_RATE_HZ = 200
_FOCAL_LENGTH = 300.0
"""Pixels: of an event camera of 346 x 260 with a wide lens."""
DEPTH = 2.0

_JUMP_RATE_HZ = 100
_START = from_seconds(1.0)
_SECONDS = 2.0
_EVENTS = 20_000
# Near the first and the last pose a spline has only one neighbour.
_MARGIN = 0.3
_NEAR_KNOTS = 6


def motion(stamps: Stamps) -> Array:
    """Return poses (N, 7) of a hand-held camera in the world, analytic in time."""
    t = (stamps - _START) * 1e-9
    place = np.stack([0.2 * np.sin(9.0 * t), 0.15 * np.sin(14.0 * t + 1.0),
                      0.1 * np.sin(20.0 * t + 2.0)], axis=-1)
    turn = np.stack([0.25 * np.sin(16.0 * t), 0.3 * np.sin(11.0 * t + 1.0),
                     0.4 * np.sin(7.0 * t + 2.0)], axis=-1)
    return np.concatenate([place, so3.exp_many(turn)], axis=-1)


def poses_at(rate_hz: int) -> Stamps:
    """Return the stamps of a tracker's poses."""
    return np.arange(round(_SECONDS * rate_hz) + 1) * (10**9 // rate_hz) + _START


def events() -> Stamps:
    """Return the stamps of events of a camera, which occur at any microsecond."""
    first, last = from_seconds(_MARGIN), from_seconds(_SECONDS - _MARGIN)
    micros = np.random.default_rng(1).integers(first // 1000, last // 1000, _EVENTS)
    return _START + 1000 * np.sort(micros)


def pixels(truth: Array, found: Array) -> Array:
    """Return the errors in the image of points straight ahead, (N,) pixels."""
    seen = se3.apply_many(se3.inverse_many(found), se3.apply_many(
        truth, np.broadcast_to([0.0, 0.0, DEPTH], (len(truth), 3))))
    return _FOCAL_LENGTH * np.hypot(seen[:, 0], seen[:, 1]) / seen[:, 2]


class Between(NamedTuple):
    """The largest errors between poses: straight from one to the next, and on a spline."""

    rate_hz: int
    straight_m: float
    straight_rad: float
    straight_px: float
    spline_m: float
    spline_rad: float
    spline_px: float


def between(rate_hz: int) -> Between:
    """Look up the camera at every event, in a buffer that has poses at a rate."""
    stamps, asked = poses_at(rate_hz), events()
    truth, found = motion(asked), []
    for buffer in _both(stamps, motion(stamps), rate_hz):
        poses = np.asarray(buffer.lookup_many('world', 'camera', asked))
        moved, turned = se3.distance_many(truth, poses)
        found += [float(error.max()) for error in (moved, turned, pixels(truth, poses))]
    return Between(rate_hz, *found)


def _both(stamps: Stamps, poses: Array, knot_rate_hz: float) -> tuple[BufferCore, BufferCore]:
    """Return a buffer that has the poses, and one that has the spline through them."""
    straight, curved = BufferCore(UNLIMITED), BufferCore(UNLIMITED)
    straight.insert_track('world', 'camera', stamps, poses)
    curved.insert_curve('world', 'camera', Spline.fit(stamps, poses, knot_rate_hz))
    return straight, curved


class Noisy(NamedTuple):
    """The remaining noise, root mean square: of poses, and of the angular velocity."""

    way: str
    moved_m: float
    turned_rad: float
    turning: float
    """Error of the angular velocity, rad/s."""


def _with_noise() -> list[Noisy]:
    """Return the errors of noisy poses, straight and by splines of several rates."""
    stamps, asked = poses_at(_NOISY_RATE_HZ), events()
    sigma = np.repeat(NOISE, 3)
    noise = np.random.default_rng(2).normal(0.0, sigma, (len(stamps), 6))
    poses = se3.compose_many(motion(stamps), screws.exp_many(noise))
    truth, turning = motion(asked), _turning(asked)
    straight = np.asarray(
        _both(stamps, poses, _KNOT_RATES_HZ[0])[0].lookup_many('world', 'camera', asked))
    before = stamps.searchsorted(asked, side='right') - 1
    turns = so3.log_many(so3.multiply_many(
        so3.conjugate_many(poses[before, 3:]), poses[before + 1, 3:]))
    rows = [_noisy('lerp and slerp', truth, straight, turning, turns * _NOISY_RATE_HZ)]
    for rate in _KNOT_RATES_HZ:
        spline = Spline.fit(stamps, poses, rate)
        rows.append(_noisy(f'spline, {rate} knots/s', truth, spline.poses(asked), turning,
                           spline.twists(asked)[:, 3:]))
    return rows


def _noisy(way: str, truth: Array, found: Array, turning: Array, measured: Array) -> Noisy:
    moved, turned = se3.distance_many(truth, found)
    return Noisy(way, *(float(np.sqrt(np.mean(np.square(errors)))) for errors in (
        moved, turned, np.linalg.norm(measured - turning, axis=1))))


def _turning(stamps: Stamps, step: int = 1000) -> Array:
    """Return the true angular velocity (N, 3) in the camera's axes."""
    before, after = motion(stamps - step), motion(stamps + step)
    return so3.log_many(so3.multiply_many(
        so3.conjugate_many(before[:, 3:]), after[:, 3:])) / (2e-9 * step)


# --- where the spline is wrong


def jump(stamps: Stamps) -> Array:
    """Return a position of map -> odom from a localiser, metres: it jumps by half a metre."""
    return np.where(stamps >= _START + from_seconds(_SECONDS / 2), 0.5, 0.0)


def contact(stamps: Stamps) -> Array:
    """Return the height of a foot that lands at 1 m/s, metres."""
    return np.maximum((_START + from_seconds(_SECONDS / 2) - stamps) * 1e-9, 0.0)


def wrong() -> list[tuple[float, ...]]:
    """
    Return the largest errors before a jump and before a contact, in bands of one knot.

    :return: the number of knots before, and metres: straight and spline, jump and contact.
    """
    columns = []
    for height in (jump, contact):
        stamps = poses_at(_JUMP_RATE_HZ)
        for buffer in _both(stamps, _upright(height(stamps)), _JUMP_RATE_HZ):
            columns.append(_in_bands(buffer, height))
    return [*zip(range(_NEAR_KNOTS), *columns, strict=True)]


def _upright(heights: Array) -> Array:
    poses = np.tile(se3.IDENTITY, (len(heights), 1))
    poses[:, 2] = heights
    return poses


def _in_bands(buffer: BufferCore, height: Callable[[Stamps], Array]) -> list[float]:
    period, middle = 10**9 // _JUMP_RATE_HZ, _START + from_seconds(_SECONDS / 2)
    errors = []
    for number in range(_NEAR_KNOTS):
        end = middle - number * period
        # A nanosecond less, because at the end of the first band the frame has jumped.
        asked = np.linspace(end - period, end - 1, 200).astype(np.int64)
        found = buffer.lookup_many('world', 'camera', asked)[:, 2]
        errors.append(float(np.abs(found - height(asked)).max()))
    return errors


# --- the report


def power(rates: list[float], errors: list[float]) -> float:
    """Return n of error = k T^n, with T the time between poses."""
    return -float(np.polyfit(np.log(rates), np.log(errors), 1)[0])


def run() -> Report:
    """Look up an event camera between poses, with noise, and at motions that are not smooth."""
    rows, noisy, bands = [between(rate) for rate in RATES_HZ], _with_noise(), wrong()
    smooth = rows[2:]
    rates = [float(row.rate_hz) for row in smooth]
    powers = {name: power(rates, [getattr(row, name) for row in smooth])
              for name in Between._fields[1:] if not name.endswith('px')}
    at_100 = rows[3]
    best = min(noisy, key=lambda row: row.turned_rad)
    return Report(
        tables=[_between_table(rows), _noise_table(noisy), _wrong_table(bands)],
        law=f'between poses T apart lerp and slerp are off by k T^{powers["straight_m"]:.1f}, '
            f'a spline by k T^{powers["spline_m"]:.1f} in position and '
            f'k T^{powers["spline_rad"]:.1f} in rotation: at {at_100.rate_hz} Hz '
            f'{at_100.straight_px:.3f} against {at_100.spline_px:.5f} pixels. At a jump it is '
            'wrong before it happens.',
        remarks=[
            f'With noise, as many knots as poses are too many, because nothing is averaged. The '
            f'best was {best.way}, which leaves '
            f'{best.turned_rad / noisy[0].turned_rad:.2f} of the error '
            f'of the rotation and {best.turning / noisy[0].turning:.3f} of that of the angular '
            f'velocity. Too few knots for the motion are worse than none: a {noisy[1].way}, has '
            f'an error of {noisy[1].moved_m * 1e3:.0f} mm.'],
        numbers={'powers': powers, 'straight_px_at_100_hz': at_100.straight_px,
                 'spline_px_at_100_hz': at_100.spline_px,
                 'best_knots': best.way, 'jump_one_knot_before_m': bands[1][2]},
        draw=partial(_draw, rows))


def _between_table(rows: list[Between]) -> Table:
    return Table(
        f'{_EVENTS:,} events at any microsecond, by the rate of the poses: the largest errors '
        f'(pixels of a point at {DEPTH:g} m)',
        (Column('rate_hz', 'poses [Hz]', '.0f'), Column('straight_m', 'lerp [mm]', '.4f'),
         Column('straight_rad', 'slerp [deg]', '.4f'), Column('straight_px', 'both [px]', '.4f'),
         Column('spline_m', 'spline [mm]', '.6f'), Column('spline_rad', 'spline [deg]', '.6f'),
         Column('spline_px', 'spline [px]', '.6f')), rows)


def _noise_table(rows: list[Noisy]) -> Table:
    return Table(
        f'Poses at {_NOISY_RATE_HZ} Hz with noise of {NOISE[0] * 1e3:g} mm and '
        f'{degrees(NOISE[1]):.1f} deg in each axis: the remaining error (rms)',
        (Column('way', 'way'), Column('moved_m', 'position [mm]', '.3f'),
         Column('turned_rad', 'rotation [deg]', '.3f'),
         Column('turning', 'angular velocity [rad/s]', '.4f')), rows)


def _wrong_table(rows: list[tuple[float, ...]]) -> Table:
    return Table(
        f'Poses and knots at {_JUMP_RATE_HZ} Hz: the largest error before a jump of 0.5 m, and '
        'before a foot lands at 1 m/s',
        (Column('knots', 'knots before', '.0f'),
         Column('straight_jump_m', 'jump, lerp [mm]', '.3f'),
         Column('spline_jump_m', 'jump, spline [mm]', '.3f'),
         Column('straight_contact_m', 'contact, lerp [mm]', '.4f'),
         Column('spline_contact_m', 'contact, spline [mm]', '.4f')), rows)


def _draw(rows: list[Between], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    rates = [row.rate_hz for row in rows]
    for style, name, label in ((STYLES[1], 'straight_px', 'lerp and slerp'),
                               (STYLES[2], 'spline_px', 'cubic spline')):
        left.loglog(rates, [getattr(row, name) for row in rows], **style, label=label)
    left.set(xlabel='rate of the poses [Hz]', ylabel='largest error in the image [px]',
             title='An event camera between two poses')
    name_ticks(left, rates)
    left.legend(loc='lower left')
    _draw_jump(right)


def _draw_jump(axes: Axes) -> None:
    stamps, middle = poses_at(_JUMP_RATE_HZ), _START + from_seconds(_SECONDS / 2)
    near = from_seconds(0.06)
    asked = np.arange(middle - near, middle + near, near // 300)
    millis = (asked - middle) * 1e-6
    axes.plot(millis, jump(asked) * 100.0, color=GREY, linewidth=6.0, alpha=0.4, label='truth')
    for style, buffer, label in zip(
            STYLES[1:3], _both(stamps, _upright(jump(stamps)), _JUMP_RATE_HZ),
            ('lerp', 'spline'), strict=True):
        found = buffer.lookup_many('world', 'camera', asked)[:, 2]
        axes.plot(millis, found * 100.0, color=style['color'], linestyle=style['linestyle'],
                  label=label)
    axes.set(xlabel='time, from the jump [ms]', ylabel='position [cm]', ylim=(-12.0, 75.0),
             title=f'A jump, poses and knots at {_JUMP_RATE_HZ} Hz')
