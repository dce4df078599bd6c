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

"""Three odometries of one edge, and the one in use goes wrong: to another without a jump."""

from functools import partial
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core import BufferCore, Pose, UNLIMITED
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.core.times import Stamps

from .pictures import GREY, STYLES
from .report import Column, Report, Table

SUMMARY = 'wheels slip, a camera takes over: 40 cm in one step, or 0.3 m/s'

MAX_SPEED, MAX_TURN_RATE = 0.3, 0.2
MAX_AGE_S, GATE = 0.2, (0.1, 0.05)

_SPEED, _RADIUS = 0.6, 3.0
_STEP = from_seconds(0.02)
_SLIPS_AT, _ENDS_AT = from_seconds(4.0), from_seconds(20.0)
_STAMPS: Stamps = np.arange(0, _ENDS_AT + 1, _STEP)
# The camera's odometry began elsewhere: what it calls odom differs by this.
_BEGAN = Pose.from_xyz_rpy(x=0.5, y=-0.4, yaw=0.1)


class Run(NamedTuple):
    """
    What a planner is told of odom -> base, sample by sample.

    :ivar poses: (N, 7) at the lab's stamps.
    :ivar told: what the rule had to say.
    """

    name: str
    poses: Array
    told: str = ''

    @property
    def steps(self) -> Array:
        """Return how far it goes from one sample to the next, (N - 1,) metres."""
        return np.linalg.norm(np.diff(self.poses[:, :3], axis=0), axis=1)

    @property
    def turned(self) -> float:
        """Return the largest turn from one sample to the next, radians."""
        return float(se3.distance_many(self.poses[:-1], self.poses[1:])[1].max())

    @property
    def drifted(self) -> float:
        """Return how far its motion since the slip is off in the end, metres."""
        began = int(np.searchsorted(_STAMPS, _SLIPS_AT - from_seconds(1.0)))
        moved = se3.compose(se3.inverse(tuple(self.poses[began])), tuple(self.poses[-1]))
        truth = se3.compose(se3.inverse(driven(int(_STAMPS[began]))), driven(_ENDS_AT))
        return math.dist(moved[:3], truth[:3])


def driven(stamp: int, slipped: float = 0.0) -> Pose:
    """Return where the robot is on its circle, or thinks that it is after some metres of slip."""
    angle = (_SPEED * as_seconds(stamp) + slipped) / _RADIUS
    return Pose.from_xyz_rpy(
        x=_RADIUS * math.sin(angle), y=_RADIUS * (1.0 - math.cos(angle)), yaw=angle)


def wheels(stamp: int) -> Pose:
    """Return what the wheels say: from the slip on they turn 1.4 times as fast."""
    return driven(stamp, 0.4 * _SPEED * max(as_seconds(stamp - _SLIPS_AT), 0.0))


def camera(stamp: int) -> Pose:
    """Return what the camera says."""
    return _BEGAN @ driven(stamp)


def lidar(stamp: int) -> Pose:
    """Return what a lidar says, which began elsewhere again."""
    return Pose(y=0.3) @ driven(stamp)


def by_rule() -> tuple[Run, int]:
    """Return the run in which the rule goes over to the camera, and when it does."""
    buffer = BufferCore(UNLIMITED)
    told = []
    for stamp in _STAMPS.tolist():
        for name, says in (('wheels', wheels), ('camera', camera), ('lidar', lidar)):
            told += buffer.insert_from(name, 'odom', 'base', stamp, says(stamp))
        if stamp == 0:
            buffer.switch_by_rule(
                'base', max_age=from_seconds(MAX_AGE_S), gate=GATE, max_speed=MAX_SPEED,
                max_turn_rate=MAX_TURN_RATE)
    poses = buffer.lookup_many('odom', 'base', _STAMPS)
    return Run('switch, by rule', poses, told[0].detail), told[0].stamp


def added_speed(ours: Array, camera_says: Array, at: int) -> float:
    """Return how fast poses (N, 7) come over to the camera's from a stamp on, at most, m/s."""
    offsets = (ours - camera_says)[at <= _STAMPS, :3]
    return float(np.linalg.norm(np.diff(offsets, axis=0), axis=1).max()) / as_seconds(_STEP)


def run() -> Report:
    """Let the wheels slip, and see what a planner is told in three ways."""
    ours, at = by_rule()
    stamps = _STAMPS.tolist()
    added = added_speed(ours.poses, np.array([camera(stamp) for stamp in stamps]), at)
    runs = [Run('the wheels, for ever', np.array([wheels(stamp) for stamp in stamps])),
            Run('the camera, from one message to the next', np.array(
                [wheels(stamp) if stamp <= at else camera(stamp) for stamp in stamps])),
            ours]
    jump = float(runs[1].steps.max())
    return Report(
        tables=[Table(
            'Wheels that slip from 4 s on, beside a camera and a lidar, until 20 s',
            (Column('name', 'odom -> base by'),
             Column('step_m', 'largest step [cm]', '.1f', 100.0),
             Column('turn_rad', 'largest turn [deg]', '.2f', math.degrees(1.0)),
             Column('drift_m', 'motion off in the end [m]', '.2f')),
            [(one.name, float(one.steps.max()), one.turned, one.drifted)
             for one in runs])],
        law=f'going over in one message is a step of {jump:.2f} m, '
            f'{jump / as_seconds(_STEP):.0f} m/s for whoever divides it by its 20 ms; '
            f'blended it adds {added:.2f} m/s, of the '
            f'{MAX_SPEED} m/s that were allowed.',
        remarks=[f'The rule said at {as_seconds(at):.2f} s: {ours.told}.'],
        numbers={'jump_m': jump, 'added_mps': added, 'noticed_s': as_seconds(at - _SLIPS_AT)},
        draw=partial(_draw, runs, at))


def _draw(runs: list[Run], at: int, figure: Any) -> None:
    left, right = figure.subplots(1, 2)
    for one, style in zip(runs, STYLES, strict=False):
        line = {**style, 'marker': ''}
        left.plot(one.poses[:, 0], one.poses[:, 1], **line, label=one.name)
        right.plot(_STAMPS[1:] / 1e9, one.steps / as_seconds(_STEP), **line)
    left.set(xlabel='x [m]', ylabel='y [m]', title='Where the robot is told to be')
    left.set_aspect('equal')
    left.set_ylim(-2.2, 6.3)
    left.legend(loc='lower center', fontsize=7.0)
    right.axhline(_SPEED + MAX_SPEED, color=GREY, linewidth=0.8)
    right.axvline(at / 1e9, color=GREY, linewidth=0.8)
    right.set(xlabel='time [s]', ylabel='speed [m/s]', ylim=(0.0, 1.5), xlim=(2.0, 14.0),
              title='How fast it seems to be')
