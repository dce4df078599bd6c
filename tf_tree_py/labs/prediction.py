# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Prediction beyond the newest data: the error, and whether the covariance covers it."""

from functools import partial
from math import dist, sin, sqrt, tau
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import FutureExtrapolationException, Pose
from tf_tree_py.core.stamp import as_seconds, from_seconds

from .coverage import by_robot
from .report import Axes, Column, Figure, GREY, name_ticks, Report, STYLES, Table

SUMMARY = 'beyond the newest data: how far off, and whether the covariance knows it'

_AHEADS = tuple(map(from_seconds, (0.020, 0.050, 0.100, 0.200, 0.400)))
_HORIZON = from_seconds(0.5)
PERIOD = from_seconds(0.020)
SPEED, BRAKE_AT, BRAKE = 1.0, from_seconds(20.0), 2.0
# A square of that many deviations leaves out a twentieth: two numbers, chi-square.
_CHI_SQUARE = 5.991

_BEGIN, _END = from_seconds(8.0), from_seconds(18.0)


class Ahead(NamedTuple):
    """
    Predictions by one time, over many moments.

    :ivar ahead: nanoseconds.
    :ivar latest: the mean error of the newest pose, metres.
    :ivar predicted: the mean error of the prediction, metres.
    :ivar claimed: the mean standard deviation in its covariance, metres.
    :ivar inside: the share of errors inside its ellipse of 95 %.
    """

    ahead: int
    latest: float
    predicted: float
    claimed: float
    inside: float


def slalom(stamp: int) -> Pose:
    """Return a robot that swerves at changing speeds, and brakes hard at BRAKE_AT."""
    # Before the brake its course is a smooth function of time.
    seconds = as_seconds(min(stamp, BRAKE_AT))
    x = SPEED * seconds + 0.25 * sin(tau * 0.31 * seconds)
    y, yaw = 0.4 * sin(tau * 0.23 * seconds), 0.5 * sin(tau * 0.23 * seconds + 1.4)
    braking = min(as_seconds(max(stamp - BRAKE_AT, 0)), SPEED / BRAKE)
    return Pose.from_xyz_rpy(x=x + SPEED * braking - 0.5 * BRAKE * braking ** 2, y=y, yaw=yaw)


def _driven_until(end: int) -> BufferCore:
    """Return a buffer that a drive has filled at 50 Hz up to a time."""
    buffer = BufferCore()
    for stamp in range(PERIOD, end + 1, PERIOD):
        buffer.insert('odom', 'base', stamp, slalom(stamp))
    return buffer


def _how_far_off(ahead: int) -> Ahead:
    """Predict by a time from many moments, and compare with the actual poses."""
    buffer = _driven_until(_BEGIN)
    rows = []
    for now in range(_BEGIN + PERIOD, _END, PERIOD):
        buffer.insert('odom', 'base', now, slalom(now))
        if now % from_seconds(0.3):
            continue
        found = buffer.predict('odom', 'base', now + ahead, _HORIZON)
        truth = slalom(now + ahead)
        off = np.subtract(truth[:2], found.pose[:2])
        floor = found.covariance[:2, :2]
        inside = float(off @ np.linalg.solve(floor, off) < _CHI_SQUARE)
        rows.append((dist(truth[:2], slalom(now)[:2]), float(np.linalg.norm(off)),
                     sqrt(np.trace(floor)), inside))
    return Ahead(ahead, *np.mean(rows, axis=0).tolist())


def braking(since: int) -> tuple[float, float]:
    """
    Predict 0.2 s ahead while it brakes for the first time, some nanoseconds after the brake.

    :return: the error, and its standard deviation in the covariance, metres.
    """
    now, ahead = BRAKE_AT + since, from_seconds(0.2)
    found = _driven_until(now).predict('odom', 'base', now + ahead, _HORIZON)
    return (dist(found.pose[:2], slalom(now + ahead)[:2]),
            sqrt(np.trace(found.covariance[:2, :2])))


def _beyond_the_horizon() -> str:
    """Return the error message of a prediction beyond the horizon."""
    try:
        _driven_until(_BEGIN).predict('odom', 'base', _BEGIN + 2 * _HORIZON, _HORIZON)
    except FutureExtrapolationException as error:
        return str(error)
    return ''


def fit(aheads: list[Ahead]) -> float:
    """Return a of the error a dt (dt + 0.1 s)/2, m/s^2."""
    times = np.array([as_seconds(one.ahead) for one in aheads])
    offs = np.array([one.predicted for one in aheads])
    return float(np.exp(np.mean(np.log(2.0 * offs / (times * (times + 0.1))))))


def run() -> Report:
    """Predict robots that swerve, brake, start, turn and fly."""
    aheads = [_how_far_off(ahead) for ahead in _AHEADS]
    brakes = [(since, *braking(from_seconds(since))) for since in (-0.2, -0.1, 0.0, 0.1, 0.3)]
    acceleration = fit(aheads)
    tenth = aheads[_AHEADS.index(from_seconds(0.1))]
    inside = float(np.mean([one.inside for one in aheads]))
    return Report(
        tables=[_ahead_table(aheads), _brake_table(brakes), _robot_table()],
        law='the newest pose is off by v dt, a prediction by a dt (dt + 0.1 s)/2, for its twist '
            f'is the mean of the last 0.1 s (fitted: a = {acceleration:.2f} m/s^2): at 0.1 s '
            f'{tenth.latest * 100.0:.1f} cm against {tenth.predicted * 100.0:.2f} cm. The '
            'covariance is that of the errors of earlier predictions, and at least that of a '
            f'stop; its 95 % contained {inside * 100.0:.0f} % of the errors.',
        remarks=[f'Beyond the horizon there is no answer: {_beyond_the_horizon()}',
                 'A first start, a first turn, and a first brake to rest in less than half a '
                 'second are not covered, unless the limit is given: '
                 "predict(..., acceleration={'base': (4.0, 0.0, 0.0, 0.0, 0.0, 0.0)})."],
        numbers={'acceleration': acceleration, 'inside': inside, 'latest_m': tenth.latest,
                 'predicted_m': tenth.predicted},
        draw=partial(_draw, aheads))


def _ahead_table(aheads: list[Ahead]) -> Table:
    return Table(
        f'A robot that swerves at about {SPEED:g} m/s, known at 50 Hz: mean errors',
        (Column('ahead_s', 'ahead [ms]', '.0f'), Column('latest_m', 'the newest pose [cm]', '.2f'),
         Column('predicted_m', 'predicted [cm]', '.3f'),
         Column('claimed_m', 'its sigma [cm]', '.3f'), Column('inside', 'in the 95 % [%]', '.0f')),
        [(as_seconds(one.ahead), one.latest, one.predicted, one.claimed, one.inside)
         for one in aheads])


def _brake_table(brakes: list[tuple[float, float, float]]) -> Table:
    return Table(
        f'It brakes at {BRAKE:g} m/s^2, for the first time: 200 ms ahead',
        (Column('since_s', 'after the brake [ms]', '.0f'), Column('off_m', 'off by [cm]', '.2f'),
         Column('claimed_m', 'its sigma [cm]', '.2f')), brakes)


def _robot_table() -> Table:
    return Table(
        'Errors in the regions of 68 and 95 %, also in the second after it begins to brake, start '
        'or turn: samples at 10, 25 and 100 Hz, 50 to 500 ms ahead',
        (Column('name', 'the robot'), Column('noise', 'noise [mm]', '.0f'),
         Column('in_68', 'in 68 % [%]', '.0f'), Column('in_95', 'in 95 % [%]', '.0f'),
         Column('in_event', 'in 95 % in that second [%]', '.0f'),
         Column('wider', 'sigma/error', '.1f')), by_robot())


def _draw(aheads: list[Ahead], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    times = [as_seconds(one.ahead) * 1e3 for one in aheads]
    for style, name, label in zip(STYLES, ('latest', 'predicted', 'claimed'), (
            'the newest pose', 'predicted', 'σ of the prediction'), strict=False):
        left.loglog(times, [getattr(one, name) * 100.0 for one in aheads], **style, label=label)
    left.set(xlabel='time ahead [ms]', ylabel='mean error [cm]', title='A robot that swerves')
    name_ticks(left, times)
    _draw_course(right)


def _draw_course(axes: Axes) -> None:
    """Draw the predictions from a few moments, with their ellipses."""
    way = np.array([slalom(stamp)[:2] for stamp in range(_BEGIN, _END, PERIOD)])
    axes.plot(*way.T, color=GREY, linewidth=4.0, alpha=0.4, label='true path')
    circle = np.linspace(0.0, tau, 49)
    for now in range(_BEGIN + from_seconds(0.6), _END - _HORIZON, from_seconds(1.8)):
        buffer = _driven_until(now)
        found = [buffer.predict('odom', 'base', now + ahead, _HORIZON)
                 for ahead in range(0, _HORIZON, PERIOD)]
        axes.plot(*np.array([one.pose[:2] for one in found]).T, color=STYLES[1]['color'],
                  label='predicted, 0.5 s ahead' if now < _BEGIN + from_seconds(1.0) else None)
        values, vectors = np.linalg.eigh(found[-1].covariance[:2, :2])
        ring = vectors @ (sqrt(_CHI_SQUARE) * np.sqrt(values)[:, None]
                          * [np.cos(circle), np.sin(circle)])
        axes.plot(found[-1].pose.x + ring[0], found[-1].pose.y + ring[1],
                  color=STYLES[2]['color'], linewidth=1.0)
    axes.set(xlabel='x [m]', ylabel='y [m]', ylim=(-1.2, 1.2),
             title='Predictions, with ellipses of 95 %')
    axes.legend(loc='upper right')
