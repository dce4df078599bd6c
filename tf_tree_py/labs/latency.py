# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Latency: a pose that is looked up too late has an error of speed times delay."""

from collections.abc import Callable, Iterable
from functools import partial
from math import dist, hypot, sin
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.screws import exp

from .report import Axes, Column, Figure, GREY, Report, STYLES, Table

SUMMARY = "a late lookup is wrong by speed times delay; the header's stamp is not"

SPEEDS = (0.25, 0.5, 1.0)
DELAYS = tuple(map(from_seconds, (0.0, 0.020, 0.050, 0.100)))
PERIOD = from_seconds(0.010)
BASE_T_CAMERA = Pose.from_xyz_rpy(x=0.2, z=0.5)

# Images are not synchronised with the drive's timer: most are taken between two ticks.
_IMAGES = tuple(from_seconds(1.0) + number * from_seconds(0.0137) for number in range(40))
_TRANSPORT = from_seconds(0.003)

_TURNING_SPEED = 0.5
_TURN_RATES = (0.0, 0.5, 1.0, 2.0)
_TURNING_DELAYS = tuple(map(from_seconds, (0.050, 0.100, 0.500)))
_AHEAD = (1.0, 0.0, 0.0)

Motion = Callable[[int], Pose]


class Late(NamedTuple):
    """The mean errors of lookups for images, metres, at one speed and one delay."""

    speed: float
    delay: int
    asked_late: float
    """Looked up at the time of the lookup."""
    latest: float
    """Looked up the latest."""
    stamped: float
    """Looked up at the image's own stamp."""


class Turning(NamedTuple):
    """The same with rotation: the error of a point 1 m ahead of the base."""

    rate: float
    delay: int
    asked_late: float
    tangent: float
    chord: float
    stamped: float
    """Looked up at the image's own stamp."""


def pose_at(speed: float, turn_rate: float, stamp: int) -> Pose:
    """Return odom_T_base_link, driving since the stamp 0 at constant speeds (m/s, rad/s)."""
    seconds = as_seconds(stamp)
    return Pose._make(exp((speed * seconds, 0.0, 0.0, 0.0, 0.0, turn_rate * seconds)))


class Robot:
    """
    A buffer that a drive feeds at 100 Hz, each transform stamped with its true time.

    :ivar buffer: the transforms published so far.
    """

    def __init__(self, odom_T_base: Motion) -> None:
        self.buffer = BufferCore()
        self.buffer.insert('base_link', 'camera', LATEST, BASE_T_CAMERA, static=True)
        self._odom_T_base = odom_T_base
        self._next = PERIOD

    def live_until(self, now: int) -> None:
        """Publish all transforms up to a time."""
        while self._next <= now:
            self.buffer.insert('odom', 'base_link', self._next, self._odom_T_base(self._next))
            self._next += PERIOD


def lateness(speed: float, delay: int) -> Late:
    """Look up the camera for 40 images, each a delay (nanoseconds) after it was taken."""
    robot = Robot(partial(pose_at, speed, 0.0))
    errors = []
    for image in _IMAGES:
        now = image + delay
        # A lookup of the current time waits for the next transform, which is not published yet.
        robot.live_until(now)
        latest = robot.buffer.lookup('odom', 'camera', LATEST)
        robot.live_until(now + PERIOD)
        truth = pose_at(speed, 0.0, image) @ BASE_T_CAMERA
        errors.append([dist(pose.translation, truth.translation) for pose in (
            robot.buffer.lookup('odom', 'camera', now), latest,
            robot.buffer.lookup('odom', 'camera', image))])
    return Late(speed, delay, *np.mean(errors, axis=0).tolist())


def turning(rate: float, delay: int) -> Turning:
    """Look up, too late, a point ahead of a robot that drives in a circle."""
    robot = Robot(partial(pose_at, _TURNING_SPEED, rate))
    image = _IMAGES[1]
    robot.live_until(image + delay + PERIOD)
    seen, late = (robot.buffer.lookup('odom', 'base_link', stamp) @ _AHEAD
                  for stamp in (image, image + delay))
    truth = pose_at(_TURNING_SPEED, rate, image) @ _AHEAD
    seconds = as_seconds(delay)
    # v + w x r of a point at r = (ahead, 0, 0): v forwards, and w times ahead sideways.
    speed = hypot(_TURNING_SPEED, rate * _AHEAD[0])
    chord = speed * seconds
    if rate:
        chord = 2.0 * speed / rate * sin(0.5 * rate * seconds)
    return Turning(rate, delay, dist(truth, late), speed * seconds, chord, dist(truth, seen))


def _asking_for_now() -> list[str]:
    """
    Look up now, and the latest, when each image is processed, 50 ms late.

    :return: the errors of the former, for which no data has arrived yet.
    """
    robot = Robot(partial(pose_at, 1.0, 0.0))
    errors = []
    for image in _IMAGES:
        now = image + from_seconds(0.050)
        robot.live_until(now - _TRANSPORT)
        try:
            robot.buffer.lookup('odom', 'camera', now)
        except TransformException as error:
            errors.append(str(error))
        robot.buffer.lookup('odom', 'camera', LATEST)  # it answers
    return errors


def slopes(rows: list[Late]) -> dict[float, float]:
    """Return the fitted error for each speed: metres per second of delay."""
    fits = {}
    for speed in SPEEDS:
        delays, errors = zip(*[(as_seconds(row.delay), row.asked_late)
                               for row in rows if row.speed == speed], strict=True)
        fits[speed] = float(np.polyfit(delays, errors, 1)[0])
    return fits


def run() -> Report:
    """Measure with every speed and delay, and with rotation."""
    rows = [lateness(speed, delay) for speed in SPEEDS for delay in DELAYS]
    turns = [turning(rate, delay) for rate in _TURN_RATES for delay in _TURNING_DELAYS]
    errors, fits, asked = _asking_for_now(), slopes(rows), len(_IMAGES)
    worst = max([row.stamped for row in rows] + [turn.stamped for turn in turns])
    written = ', '.join(f'{speed:g} m/s: {slope:.4f}' for speed, slope in fits.items())
    return Report(
        tables=[_late_table(rows), _turning_table(turns)],
        law=f'the error of a late lookup is speed times delay (fitted slopes in m/s, for '
            f'{written}); with the stamp in the header the error is at most '
            f'{worst * 1e3:.2g} mm at any delay.',
        remarks=[
            f'{len(errors)} of {asked} lookups of the current time raised an error, because '
            f'the data cannot have arrived yet. {asked} of {asked} lookups of the latest returned '
            f'a wrong pose without an error. The error is: "{errors[-1]}."'],
        numbers={'slopes': {str(speed): slope for speed, slope in fits.items()},
                 'worst_stamped_m': worst, 'now_asked': asked, 'now_raised': len(errors),
                 'latest_answered': asked},
        draw=partial(_draw, fits))


def _late_table(rows: list[Late]) -> Table:
    return Table(
        "The distance of the camera's pose from the true one when the image was taken "
        '(mean of 40 images)',
        (Column('speed', 'v [m/s]', '.2f'), Column('delay_s', 'delay [ms]', '.0f'),
         Column('law_m', 'v delay [cm]', '.2f'),
         Column('asked_late_m', 'looked up late [cm]', '.2f'),
         Column('latest_m', 'latest [cm]', '.2f'),
         Column('stamped_m', "header's stamp [mm]", '.4f')),
        [(row.speed, as_seconds(row.delay), row.speed * as_seconds(row.delay), row.asked_late,
          row.latest, row.stamped) for row in rows])


def _turning_table(turns: list[Turning]) -> Table:
    return Table(
        f'The same when turning: {_TURNING_SPEED} m/s, and an object {_AHEAD[0]:g} m ahead of the '
        'base',
        (Column('turn_rate', 'w [rad/s]', '.1f'), Column('delay_s', 'delay [ms]', '.0f'),
         Column('asked_late_m', 'looked up late [cm]', '.3f'),
         Column('tangent_m', '|v + w x r| delay [cm]', '.3f'),
         Column('chord_m', '2R sin(w delay/2) [cm]', '.3f'),
         Column('stamped_m', "header's stamp [mm]", '.4f')),
        [(turn.rate, as_seconds(turn.delay), *turn[2:]) for turn in turns])


_DRAWN_MS = range(0, 501, 100)
_BETWEEN_MS = range(50, 500, 100)


def _draw(fits: dict[float, float], figure: Figure) -> None:
    straight, turned = figure.subplots(1, 2, sharex=True, sharey=True)
    for style, speed in zip(STYLES[1:], SPEEDS, strict=True):
        straight.plot(_DRAWN_MS, [late.asked_late * 100.0 for late in _late(speed, _DRAWN_MS)],
                      **style, label=f'v = {speed:g} m/s (slope {fits[speed]:.3f})')
        straight.plot(_BETWEEN_MS, [late.latest * 100.0 for late in _late(speed, _BETWEEN_MS)],
                      color='black', linestyle='none', marker='o', fillstyle='none',
                      markersize=9.0, label='the latest: same error, no exception'
                      if speed == SPEEDS[-1] else None)
    straight.plot(_DRAWN_MS, [late.stamped * 100.0 for late in _late(SPEEDS[-1], _DRAWN_MS)],
                  **STYLES[0], label="the header's stamp, any v")
    straight.set(xlabel='delay [ms]', ylabel='error [cm]', ylim=(-5.0, 150.0),
                 title='The camera, driving straight: v · delay')
    _draw_turning(turned)


def _late(speed: float, delays_ms: Iterable[int]) -> list[Late]:
    return [lateness(speed, from_seconds(delay / 1e3)) for delay in delays_ms]


def _draw_turning(axes: Axes) -> None:
    for style, rate in zip(STYLES[1:3], (1.0, 2.0), strict=True):
        turns = [turning(rate, from_seconds(delay / 1e3)) for delay in _DRAWN_MS]
        axes.plot(_DRAWN_MS, [turn.asked_late * 100.0 for turn in turns], **style,
                  label=f'ω = {rate:g} rad/s')
        axes.plot(_DRAWN_MS, [turn.tangent * 100.0 for turn in turns], color=GREY,
                  linewidth=1.0, label='the law, ‖v + ω × r‖ · delay' if rate == 2.0 else None)
    stamped = [turning(2.0, from_seconds(delay / 1e3)).stamped for delay in _DRAWN_MS]
    axes.plot(_DRAWN_MS, [error * 100.0 for error in stamped], **STYLES[0],
              label="the header's stamp, any ω")
    axes.set(xlabel='delay [ms]', title=f'A point 1 m ahead, turning at {_TURNING_SPEED} m/s')
    axes.tick_params(labelleft=True)
