# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope between the poses: fast rotation that interpolation misses."""

from functools import partial
from math import degrees, pi, tau
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps

from .report import Axes, Column, Figure, GREY, name_ticks, Report, STYLES, Table

SUMMARY = 'a shaken camera, poses at 20 Hz: 0.16 rad off, with a gyroscope 0.0001'

RATES_HZ = (10.0, 20.0, 50.0, 100.0, 200.0)
_GYRO_RATES_HZ = (100.0, 200.0, 500.0, 1000.0)
_BIASES = (0.0, 0.01, 0.05, 0.2)
_HOLES_S = (0.0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.09, 0.12)
_GYRO_HZ = 1000.0

# A hand-held camera that is shaken: about x, y, z.
_SWING = np.array([0.25, 0.35, 0.55])
_SWING_HZ = np.array([4.0, 3.0, 5.0])
_PHASE = np.array([0.5, 1.5, 0.3])
_DURATION_S = 2.0
# The gyroscope's gaps begin at different times after a pose.
_HOLES_EVERY = from_seconds(0.217)
_ASKED = np.arange(0, from_seconds(_DURATION_S), 700_001)


class Gap(NamedTuple):
    """The largest errors of lookups between poses, radians."""

    rate_hz: float
    alone: float
    aided: float


def _angles(stamps: Stamps) -> tuple[Array, Array]:
    """Return roll, pitch and yaw (3, N), and how fast they change."""
    phase = (tau * _SWING_HZ[:, None] * stamps / NANOSECONDS_PER_SECOND + _PHASE[:, None])
    return (_SWING[:, None] * np.sin(phase),
            (_SWING * _SWING_HZ)[:, None] * tau * np.cos(phase))


def true_poses(stamps: Stamps) -> Array:
    """Return world_T_camera (N, 7) of a camera that rotates on the spot."""
    angles, _ = _angles(stamps)
    return np.array([Pose.from_xyz_rpy(roll=roll, pitch=pitch, yaw=yaw)
                     for roll, pitch, yaw in angles.T.tolist()])


def true_rates(stamps: Stamps) -> Array:
    """
    Return the measurements of a gyroscope in the camera, (N, 3) radians per second.

    They are computed from roll, pitch and yaw about fixed axes and their rates: Craig,
    "Introduction to Robotics", 3rd edition, section 5.3.
    """
    (roll, pitch, _), (d_roll, d_pitch, d_yaw) = _angles(stamps)
    return np.stack([
        d_roll - d_yaw * np.sin(pitch),
        d_pitch * np.cos(roll) + d_yaw * np.cos(pitch) * np.sin(roll),
        -d_pitch * np.sin(roll) + d_yaw * np.cos(pitch) * np.cos(roll)], axis=1)


def stamps_at(rate_hz: float) -> Stamps:
    """Return stamps at a rate, slightly beyond the span of the lookups."""
    period = from_seconds(1.0 / rate_hz)
    return np.arange(0, from_seconds(_DURATION_S) + 2 * period, period)


def filled(rate_hz: float) -> BufferCore:
    """Return a buffer with the poses at a rate."""
    buffer = BufferCore()
    stamps = stamps_at(rate_hz)
    buffer.insert_track('world', 'camera', stamps, true_poses(stamps))
    return buffer


def errors(buffer: BufferCore, stamps: Stamps = _ASKED) -> Array:
    """Return the errors of lookups at stamps, radians."""
    _, angles = se3.distance_many(
        np.asarray(buffer.lookup_many('world', 'camera', stamps)), true_poses(stamps))
    return angles


def gap(rate_hz: float, gyro_hz: float = _GYRO_HZ, bias: float = 0.0) -> Gap:
    """Return the largest errors with poses at a rate, without and with a gyroscope."""
    buffer = filled(rate_hz)
    alone = float(errors(buffer).max())
    stamps = stamps_at(gyro_hz)
    buffer.aid('camera', stamps, true_rates(stamps) + bias)
    return Gap(rate_hz, alone, float(errors(buffer).max()))


def interrupted(length: float) -> float:
    """Return the largest error with poses at 20 Hz, and gaps of the gyroscope (seconds)."""
    buffer, stamps = filled(20.0), stamps_at(_GYRO_HZ)
    passed = stamps % _HOLES_EVERY
    # It learns its period before the first gap.
    kept = stamps[(stamps <= _HOLES_EVERY) | (passed == 0) | (passed >= from_seconds(length))]
    buffer.aid('camera', kept, true_rates(kept))
    return float(errors(buffer).max())


def run() -> Report:
    """Look up a shaken camera between its poses, without and with its gyroscope."""
    gaps = [gap(rate) for rate in RATES_HZ]
    at_twenty = gaps[RATES_HZ.index(20.0)]
    biased = [gap(20.0, bias=bias) for bias in _BIASES]
    coarse = [gap(20.0, gyro_hz=rate) for rate in _GYRO_RATES_HZ]
    holes = [interrupted(length) for length in _HOLES_S]
    slope = (biased[-1].aided - biased[0].aided) / _BIASES[-1]
    return Report(
        tables=[_rate_table(gaps), _bias_table(biased), _gyro_table(coarse),
                _hole_table(holes)],
        law='between poses a rotation that changes its rate is off by alpha T^2/8, '
            f'{at_twenty.alone:.3f} rad at 20 Hz here; a gyroscope at 1 kHz leaves '
            f'{at_twenty.aided:.4f} rad, and its bias cancels but for '
            f'{slope * 1e3:.1f} mrad for each rad/s, because the result agrees with every pose.',
        remarks=['The gyroscope is used only between two poses: the poses themselves do not '
                 'change. Translations are interpolated linearly, because an angular velocity '
                 'contains no information about them.'],
        numbers={'alone_rad': at_twenty.alone, 'aided_rad': at_twenty.aided,
                 'of_bias_s': slope},
        draw=partial(_draw, gaps))


def _rate_table(gaps: list[Gap]) -> Table:
    return Table(
        'A camera that is shaken by 0.55 rad at 5 Hz: the largest error between two poses',
        (Column('rate_hz', 'poses [Hz]', '.0f'), Column('alone_rad', 'slerp [deg]', '.3f'),
         Column('aided_rad', 'with a gyroscope [deg]', '.4f'),
         Column('factor', 'better by', '.0f')),
        [(one.rate_hz, one.alone, one.aided, one.alone / one.aided) for one in gaps])


def _bias_table(gaps: list[Gap]) -> Table:
    return Table(
        'The effect of a bias of the gyroscope about all axes, with poses at 20 Hz',
        (Column('bias', 'bias [rad/s]', '.2f'), Column('aided_rad', 'off by [mrad]', '.2f')),
        [(bias, one.aided) for bias, one in zip(_BIASES, gaps, strict=True)])


def _gyro_table(gaps: list[Gap]) -> Table:
    return Table(
        'The required rate of the gyroscope, with poses at 20 Hz',
        (Column('gyro_hz', 'gyroscope [Hz]', '.0f'), Column('aided_rad', 'off by [mrad]', '.2f')),
        [(rate, one.aided) for rate, one in zip(_GYRO_RATES_HZ, gaps, strict=True)])


def _hole_table(offs: list[float]) -> Table:
    return Table(
        'Gaps of the gyroscope, with poses at 20 Hz: up to 100 ms they are bridged',
        (Column('gap_s', 'gap [ms]', '.0f'), Column('off_rad', 'off by [mrad]', '.2f')),
        [*zip(_HOLES_S, offs, strict=True)])


def _draw(gaps: list[Gap], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    rates = [one.rate_hz for one in gaps]
    left.loglog(rates, [degrees(one.alone) for one in gaps], **STYLES[0], label='slerp')
    left.loglog(rates, [degrees(one.aided) for one in gaps], **STYLES[1],
                label='with a gyroscope at 1 kHz')
    left.set(xlabel='rate of the poses [Hz]', ylabel='largest error between poses [deg]',
             title='A shaken camera')
    name_ticks(left, RATES_HZ)
    left.legend(loc='upper right')
    _draw_course(right)


def _draw_course(axes: Axes) -> None:
    """Draw the true yaw over time, and the result of lookups."""
    stamps = np.arange(0, from_seconds(0.4), 1_000_000)
    poses = stamps_at(20.0)
    poses = poses[poses <= stamps[-1]]
    buffer = filled(20.0)
    yaw = 180.0 / pi * _angles(stamps)[0][2]
    axes.plot(stamps / 1e6, yaw, color=GREY, linewidth=5.0, alpha=0.4, label='truth')
    axes.plot(stamps / 1e6, _yaws(buffer, stamps), color=STYLES[0]['color'], label='slerp')
    gyro = stamps_at(_GYRO_HZ)
    buffer.aid('camera', gyro, true_rates(gyro))
    axes.plot(stamps / 1e6, _yaws(buffer, stamps), color=STYLES[1]['color'], linestyle='--',
              label='with a gyroscope')
    axes.plot(poses / 1e6, _yaws(buffer, poses), color='black', marker='o', linestyle='none',
              label='poses, 20 Hz')
    axes.set(xlabel='time [ms]', ylabel='yaw [deg]', ylim=(-40.0, 75.0), title='Yaw during 0.4 s')
    axes.legend(loc='upper right', ncols=2)


def _yaws(buffer: BufferCore, stamps: Stamps) -> Array:
    poses = buffer.lookup_many('world', 'camera', stamps)
    return np.degrees([so3.as_rpy(tuple(pose[3:]))[2] for pose in poses])
