# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A relocaliser that is late and sometimes wrong, and an odometry that drifts."""

from collections.abc import Callable, Iterator
from functools import cache, partial
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core.anchor import Anchor, Sighting
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.blend import Limits
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.core.times import Stamps

from .pictures import GREY, STYLES
from .report import Column, Report, Table

SUMMARY = '300 ms late: naive 9 m jumps, anchored 1.4 cm off and no jump'

LATE_S, RATE_HZ, OUTLIERS = 0.3, 2.0, 0.01
SIGMA_M, SIGMA_RAD = 0.01, math.radians(0.3)
DRIFT = 0.02
LIMITS = Limits(from_seconds(0.3), 0.2, 0.1, 0.0)

STEP = from_seconds(0.02)
_DURATION_S = 240.0
_LOOP_S = 40.0
_SEED = 14
# Before this the first sightings have not agreed yet, or are still being gone over to.
_SETTLED = from_seconds(5.0)


class Pass(NamedTuple):
    """
    One way to publish map -> odom, from beginning to end.

    :ivar errors: (N,) how far map -> base is off at each stamp, metres.
    :ivar steps: (N - 1,) how far it moves from a stamp to the next, metres.
    """

    name: str
    errors: Array
    steps: Array


def driven(stamp: int) -> Pose:
    """Return map_T_base: a figure of eight, at up to 1.1 m/s."""
    phase = math.tau * as_seconds(stamp) / _LOOP_S
    x, y = 5.0 * math.sin(phase), 2.5 * math.sin(2.0 * phase)
    return Pose.from_xyz_rpy(x=x, y=y, yaw=math.atan2(2.0 * math.cos(2.0 * phase),
                                                      2.0 * math.cos(phase)))


@cache
def odometry(seconds: float) -> list[Pose]:
    """Return odom_T_base at the stamps: every motion is 2 % too long, and turns as much more."""
    poses = [Pose()]
    truth = [driven(stamp) for stamp in stamps_for(seconds).tolist()]
    for before, after in zip(truth[:-1], truth[1:], strict=True):
        twist = se3.log(before.inverse() @ after)
        x, y, z, rx, ry, rz = ((1.0 + DRIFT) * part for part in twist)
        poses.append(poses[-1] @ Pose._make(se3.exp((x, y, z, rx, ry, rz))))
    return poses


def stamps_for(seconds: float) -> Stamps:
    """Return the stamps of the odometry."""
    return np.arange(0, from_seconds(seconds) + 1, STEP)


def sightings(seconds: float) -> Iterator[tuple[int, Pose]]:
    """Yield each stamp that the relocaliser has an image of, and where it thinks it was."""
    rng = np.random.default_rng(_SEED)
    for stamp in range(0, from_seconds(seconds), from_seconds(1.0 / RATE_HZ)):
        x, y, yaw = rng.normal(0.0, (SIGMA_M, SIGMA_M, SIGMA_RAD)).tolist()
        truth = driven(stamp)
        # Errors as the covariance has them: in the map's axes, about the robot.
        seen = Pose.from_parts(np.add(truth[:3], (x, y, 0.0)),
                               (Pose.from_xyz_rpy(yaw=yaw) @ truth)[3:])
        if rng.random() < OUTLIERS:
            seen = Pose.from_xyz_rpy(*rng.uniform(-5.0, 5.0, 2).tolist(),
                                     yaw=float(rng.uniform(-math.pi, math.pi)))
        yield stamp, seen


COVARIANCE = np.diag([SIGMA_M**2] * 2 + [1e-6] * 3 + [SIGMA_RAD**2])


class Unanchored:
    """Nobody publishes anything but where the robot began, which is known."""

    name = 'no anchor'

    def take(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Ignore a sighting."""

    def publish(self, stamp: int) -> Pose:
        """Return map_T_odom."""
        return driven(0)


class Naive(Unanchored):
    """What comes is published when it comes, as if it were of that moment."""

    name = 'published when it comes'

    def __init__(self) -> None:
        self._held = driven(0)

    def take(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Put the robot where it was seen."""
        self._held = seen @ odom_T_now.inverse()

    def publish(self, stamp: int) -> Pose:
        """Return map_T_odom."""
        return self._held


class OldStamp(Naive):
    """Each is held against the odometry of its own stamp, and believed."""

    name = 'at its old stamp, ungated'

    def take(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Put the robot where it must be by now."""
        self._held = seen @ odom_T_then.inverse()


class Anchored(Unanchored):
    """``tf_tree_py.core.anchor``."""

    name = 'relocalisation_anchor'

    def __init__(self) -> None:
        self.refused = 0
        self._anchor = Anchor(LIMITS)

    def take(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Let the anchor judge it."""
        self.refused += not self._anchor.take(Sighting(
            stamp, seen, COVARIANCE, odom_T_then, np.zeros((6, 6)))).accepted

    def publish(self, stamp: int) -> Pose:
        """Return map_T_odom."""
        return self._anchor.publish(stamp) or driven(0)


def passed(way: Unanchored, seconds: float = _DURATION_S) -> Pass:
    """Let a robot drive, with one way to publish map -> odom."""
    stamps = stamps_for(seconds)
    odom_T_base = odometry(seconds)
    coming = sightings(seconds)
    seen_at, seen = next(coming)
    told = []
    for number, stamp in enumerate(stamps.tolist()):
        while seen_at + from_seconds(LATE_S) <= stamp:
            way.take(seen_at, seen, odom_T_base[seen_at // STEP], odom_T_base[number])
            seen_at, seen = next(coming, (int(stamps[-1]) + 1, seen))
        told.append(way.publish(stamp) @ odom_T_base[number])
    return measured(way.name, stamps, np.array(told))


def measured(name: str, stamps: Stamps, told: Array) -> Pass:
    """Return how far map_T_base (N, 7) is off, and how far it goes from stamp to stamp."""
    truth = np.array([driven(stamp) for stamp in stamps.tolist()])
    return Pass(name, np.linalg.norm((told - truth)[:, :3], axis=1),
                np.linalg.norm(np.diff(told[:, :3], axis=0), axis=1))


WAYS: tuple[Callable[[], Unanchored], ...] = (Unanchored, Naive, OldStamp, Anchored)


def run() -> Report:
    """Drive for four minutes, and see where the robot is told to be."""
    ways = [way() for way in WAYS]
    passes = [passed(way) for way in ways]
    refused = next(way.refused for way in ways if isinstance(way, Anchored))
    first = int(np.searchsorted(stamps_for(_DURATION_S), _SETTLED))
    naive, ours = passes[1], passes[3]
    own = float(passes[0].steps.max())
    return Report(
        tables=[Table(
            f'A robot at up to 1.1 m/s, odometry 2 % off, poses at {RATE_HZ:g} Hz that are '
            f'{LATE_S * 1e3:.0f} ms late and 1 cm off, one of a hundred wrong',
            (Column('name', 'map -> odom'),
             Column('median_m', 'off, median [cm]', '.1f', 100.0),
             Column('most_m', '95 % [cm]', '.1f', 100.0),
             Column('worst_m', 'worst [cm]', '.1f', 100.0),
             Column('step_m', 'largest step in 20 ms [cm]', '.1f', 100.0)),
            [(one.name, *(float(np.quantile(one.errors[first:], part))
                          for part in (0.5, 0.95, 1.0)), float(one.steps[first:].max()))
             for one in passes])],
        law=f'published when it comes, a pose is wrong by v 300 ms, '
            f'{100 * np.median(naive.errors[first:]):.0f} cm here, and jumps; the anchor is '
            f'{100 * np.median(ours.errors[first:]):.1f} cm off, and no step is longer than the '
            "robot's own and the stated rate.",
        remarks=[f'It refused {refused} poses of {round(_DURATION_S * RATE_HZ)}, among them the '
                 'first, which nothing confirmed yet.'],
        numbers={'anchored_m': float(np.median(ours.errors[first:])),
                 'naive_m': float(np.median(naive.errors[first:])),
                 'own_step_m': own, 'refused': refused},
        draw=partial(_draw, passes))


def _draw(passes: list[Pass], figure: Any) -> None:
    axes = figure.subplots()
    stamps = stamps_for(_DURATION_S) / 1e9
    for one, style in zip(passes, STYLES, strict=True):
        axes.semilogy(stamps, np.maximum(100.0 * one.errors, 0.05), **{**style, 'marker': ''},
                      label=one.name, linewidth=1.0)
    axes.axhline(100.0 * SIGMA_M, color=GREY, linewidth=0.8)
    axes.set(xlabel='time [s]', ylabel='map -> base off by [cm]', xlim=(0.0, 120.0),
             title='Where the robot is told to be')
    axes.legend(loc='lower right')
