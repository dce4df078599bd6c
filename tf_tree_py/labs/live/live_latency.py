# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Latency over DDS: a drive in one process publishes, and this one looks it up too late."""

from collections.abc import Iterator
from functools import partial
from multiprocessing.connection import Connection
import time
from typing import NamedTuple

import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py.core import LATEST, TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.observers import Observer, ReceivedMessage
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import as_nanoseconds, as_pose, transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster

from .live_session import listening, session, ticks
from ..latency import BASE_T_CAMERA, DELAYS, PERIOD, pose_at, SPEEDS
from ..report import Column, Figure, Report, STYLES, Table

_IMAGES = 30
_PATIENCE = Duration(seconds=10)


class Ages(Observer):
    """Notes how old each message of moving transforms is on arrival, nanoseconds."""

    def __init__(self) -> None:
        self.ages: list[int] = []

    def received(self, arrival: ReceivedMessage) -> None:
        """Note a message as it comes off the wire."""
        if not arrival.static and arrival.batch.stamps:
            self.ages.append(time.time_ns() - arrival.batch.stamps[0])


class LookupErrors(NamedTuple):
    """
    The errors of lookups for one image, metres; positive: ahead of the true position.

    :ivar delay: the measured time from the image to the lookups, nanoseconds.
    :ivar newer: the time from the image to the stamp of the latest, nanoseconds.
    """

    speed: float
    planned: int
    delay: int
    newer: int
    latest: float
    stamped: float
    now_raised: bool


def publish(node: Node, pipe: Connection, begin: int) -> None:
    """Drive a robot at each speed since ``begin``, and publish their poses at 100 Hz."""
    moving, fixed = TransformBroadcaster(node), StaticTransformBroadcaster(node)
    fixed.sendTransform([transform_stamped(_base(speed), _camera(speed), begin, BASE_T_CAMERA)
                         for speed in SPEEDS])
    for _ in ticks(pipe, PERIOD):
        stamp = time.time_ns()
        moving.sendTransform([
            transform_stamped('odom', _base(speed), stamp, pose_at(speed, 0.0, stamp - begin))
            for speed in SPEEDS])


def _base(speed: float) -> str:
    return f'base_link_{speed * 100.0:.0f}'


def _camera(speed: float) -> str:
    return f'camera_{speed * 100.0:.0f}'


def run(images: int = _IMAGES) -> Report:
    """Take images, and look up the pose of the camera, in time and too late."""
    begin = time.time_ns()
    with session() as lab:
        arrivals = Ages()
        with listening(lab.node('lookup'), [arrivals]) as buffer:
            lab.start(publish, begin)
            for speed in SPEEDS:
                buffer.lookup_transform('odom', _camera(speed), Time(), _PATIENCE)
            looks = [look for image in _phases(images)
                     for look in _process_image(buffer, begin, image)]
    return _report(looks, np.array(arrivals.ages) / 1e9)


def _phases(images: int) -> Iterator[int]:
    """Yield the stamps of images that are spread evenly over the phases of the drive's timer."""
    start = time.time_ns()
    for number in range(images):
        # Slightly more than the longest delay, and each time at another phase of the period.
        image = start + round((number * 12 + number / images) * PERIOD)
        time.sleep(max(0, image - time.time_ns()) / 1e9)
        yield time.time_ns()


def _process_image(buffer: Buffer, begin: int, image: int) -> list[LookupErrors]:
    """Look up the camera of an image at once, and after each delay."""
    late = []
    for planned in DELAYS:
        time.sleep(max(0, image + planned - time.time_ns()) / 1e9)
        for speed in SPEEDS:
            now = time.time_ns()
            latest, newer = _ahead(buffer, speed, LATEST, begin, image)
            late.append((speed, planned, now - image, newer, latest, _raises(buffer, speed, now)))
    stamped = {speed: _ahead(buffer, speed, image, begin, image)[0] for speed in SPEEDS}
    return [LookupErrors(*look[:5], stamped[look[0]], look[5]) for look in late]


def _ahead(buffer: Buffer, speed: float, stamp: int, begin: int, image: int) -> tuple[float, int]:
    """Return how far ahead of the truth the looked-up camera is, in metres and in nanoseconds."""
    found = buffer.lookup_transform('odom', _camera(speed), Time(nanoseconds=stamp), _PATIENCE)
    truth = pose_at(speed, 0.0, image - begin) @ BASE_T_CAMERA
    return as_pose(found).x - truth.x, as_nanoseconds(found.header.stamp) - image


def _raises(buffer: Buffer, speed: float, now: int) -> bool:
    try:
        buffer.lookup_transform('odom', _camera(speed), Time(nanoseconds=now))
    except TransformException:
        return True
    return False


def _report(looks: list[LookupErrors], ages: Array) -> Report:
    fits = {speed: fit(looks, speed) for speed in SPEEDS}
    median, most, worst = (float(np.quantile(ages, q)) for q in (0.5, 0.99, 1.0))
    stamped = max(abs(look.stamped) for look in looks)
    raised = sum(look.now_raised for look in looks)
    behind = float(np.mean([age for _, age in fits.values()]))
    written = ', '.join(f'{speed:g} m/s: {slope:.3f}' for speed, (slope, _) in fits.items())
    return Report(
        tables=[_table(looks), Table(
            "The time from a transform's stamp to its insertion in another process",
            (Column('messages', 'messages'), Column('median_s', 'median [ms]', '.2f'),
             Column('p99_s', '99 % within [ms]', '.2f'), Column('worst_s', 'longest [ms]', '.2f')),
            [(len(ages), median, most, worst)])],
        law=f'over DDS too, the error of the latest is speed times delay (fitted slopes in '
            f'm/s, for {written}), minus the age of the latest, {behind * 1e3:.1f} ms; '
            f"with the header's stamp it is {max(stamped * 1e3, 1e-6):.1g} mm at most.",
        remarks=[f'{raised} of {len(looks)} lookups of the current time raised an error.'],
        numbers={'slopes': {str(speed): slope for speed, (slope, _) in fits.items()},
                 'worst_beside_law_m': max(
                     abs(look.latest - look.speed * as_seconds(look.newer)) for look in looks),
                 'latest_is_old_s': behind, 'transport_median_s': median, 'transport_p99_s': most,
                 'transport_worst_s': worst, 'worst_stamped_m': stamped, 'now_raised': raised,
                 'now_asked': len(looks)},
        draw=partial(_draw, looks, fits))


def fit(looks: list[LookupErrors], speed: float) -> tuple[float, float]:
    """Fit error = v (delay - age); return v, and the mean age of the latest, seconds."""
    delays, errors = zip(*[(as_seconds(look.delay), look.latest)
                           for look in looks if look.speed == speed], strict=True)
    slope, error_at_zero = np.polyfit(delays, errors, 1)
    return float(slope), float(-error_at_zero / slope)


def _table(looks: list[LookupErrors]) -> Table:
    rows = []
    for speed in SPEEDS:
        for planned in DELAYS:
            cell = [look for look in looks if (look.speed, look.planned) == (speed, planned)]
            delay = float(np.mean([as_seconds(look.delay) for look in cell]))
            rows.append((speed, delay, speed * delay,
                         float(np.mean([look.latest for look in cell])),
                         max(abs(look.stamped) for look in cell),
                         sum(look.now_raised for look in cell) / len(cell)))
    return Table(
        f"The error of the camera's pose (mean of {len(cell)} images)",
        (Column('speed', 'v [m/s]', '.2f'), Column('delay_s', 'delay [ms]', '.1f'),
         Column('law_m', 'v delay [cm]', '.2f'), Column('latest_m', 'latest [cm]', '.2f'),
         Column('stamped_m', "header's stamp, worst [mm]", '.4f'),
         Column('now_raised', 'now: raised an error [%]', '.0f')), rows)


def _draw(looks: list[LookupErrors], fits: dict[float, tuple[float, float]],
          figure: Figure) -> None:
    axes = figure.subplots()
    for style, speed in zip(STYLES[1:], SPEEDS, strict=True):
        own = [look for look in looks if look.speed == speed]
        slope, age = fits[speed]
        delays = np.array([0.0, 0.105])
        axes.plot([look.delay / 1e6 for look in own], [look.latest * 100.0 for look in own],
                  color=style['color'], marker=style['marker'], linestyle='none', markersize=3.5,
                  alpha=0.6)
        axes.plot(delays * 1e3, slope * (delays - age) * 100.0, color=style['color'],
                  linestyle=style['linestyle'], marker=style['marker'], markevery=[],
                  label=f'the latest, v = {speed:g} m/s (slope {slope:.3f})')
    axes.plot([look.delay / 1e6 for look in looks], [look.stamped * 100.0 for look in looks],
              color='black', marker='o', linestyle='none', markersize=2.5,
              label="the header's stamp, any v")
    axes.annotate('negative: without a delay, the latest transform\n'
                  'is older than the image, by up to one period',
                  (1.0, -0.7), (12.0, -1.6), va='center', arrowprops={'arrowstyle': '->'})
    axes.set(xlabel='delay from the image to the lookup [ms]', ylim=(-2.3, None),
             ylabel='camera in odom: too far ahead by [cm]',
             title='Two processes: a drive at 100 Hz, and lookups that come late')
