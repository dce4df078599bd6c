# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Three odometry sources of one edge: the active one fails, and is replaced without a jump."""

from functools import partial
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.core.times import Stamps

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'wheels slip, a camera takes over: 40 cm in one step, or 0.3 m/s'

MAX_SPEED, MAX_TURN_RATE = 0.3, 0.2
MAX_AGE_S, GATE = 0.2, (0.1, 0.05)

_SPEED, _RADIUS = 0.6, 3.0
_STEP = from_seconds(0.02)
_SLIPS_AT, _ENDS_AT = from_seconds(4.0), from_seconds(20.0)
_STAMPS: Stamps = np.arange(0, _ENDS_AT + 1, _STEP)
# The camera's odometry began elsewhere, so its odom frame differs by this pose.
_BEGAN = Pose.from_xyz_rpy(x=0.5, y=-0.4, yaw=0.1)


class Run(NamedTuple):
    """
    The samples of odom -> base that a planner receives.

    :ivar poses: (N, 7) at the lab's stamps.
    :ivar reason: the incident of the rule.
    """

    name: str
    poses: Array
    reason: str = ''

    @property
    def steps(self) -> Array:
        """Return the distances between consecutive samples, (N - 1,) metres."""
        return np.linalg.norm(np.diff(self.poses[:, :3], axis=0), axis=1)

    @property
    def turned(self) -> float:
        """Return the largest rotation between consecutive samples, radians."""
        return float(se3.distance_many(self.poses[:-1], self.poses[1:])[1].max())

    @property
    def drifted(self) -> float:
        """Return the final error of the motion since the slip, metres."""
        began = int(np.searchsorted(_STAMPS, _SLIPS_AT - from_seconds(1.0)))
        moved = se3.compose(se3.inverse(tuple(self.poses[began])), tuple(self.poses[-1]))
        truth = se3.compose(se3.inverse(driven(int(_STAMPS[began]))), driven(_ENDS_AT))
        return math.dist(moved[:3], truth[:3])


def driven(stamp: int, slipped: float = 0.0) -> Pose:
    """Return the pose of the robot on its circle, with an error of some metres of slip."""
    angle = (_SPEED * as_seconds(stamp) + slipped) / _RADIUS
    return Pose.from_xyz_rpy(
        x=_RADIUS * math.sin(angle), y=_RADIUS * (1.0 - math.cos(angle)), yaw=angle)


def wheels(stamp: int) -> Pose:
    """Return the pose from the wheels, which turn 1.4 times as fast during the slip."""
    return driven(stamp, 0.4 * _SPEED * max(as_seconds(stamp - _SLIPS_AT), 0.0))


def camera(stamp: int) -> Pose:
    """Return the pose from the camera."""
    return _BEGAN @ driven(stamp)


def lidar(stamp: int) -> Pose:
    """Return the pose from a lidar, which began at yet another place."""
    return Pose(y=0.3) @ driven(stamp)


def _by_rule() -> tuple[Run, int]:
    """Return the run in which the rule switches to the camera, and the time of the switch."""
    buffer = BufferCore(UNLIMITED)
    incidents = []
    for stamp in _STAMPS.tolist():
        for name, says in (('wheels', wheels), ('camera', camera), ('lidar', lidar)):
            incidents += buffer.insert_from(name, 'odom', 'base', stamp, says(stamp))
        if stamp == 0:
            buffer.switch_by_rule('base', max_age=from_seconds(MAX_AGE_S), gate=GATE,
                                  max_speed=MAX_SPEED, max_turn_rate=MAX_TURN_RATE)
    poses = np.asarray(buffer.lookup_many('odom', 'base', _STAMPS))
    return Run('blend, by rule', poses, incidents[0].detail), incidents[0].stamp


def _added_speed(ours: Array, camera_says: Array, at: int) -> float:
    """Return the maximum speed at which poses (N, 7) blend to the camera's after a stamp, m/s."""
    offsets = (ours - camera_says)[at <= _STAMPS, :3]
    return float(np.linalg.norm(np.diff(offsets, axis=0), axis=1).max()) / as_seconds(_STEP)


def run() -> Report:
    """Simulate slipping wheels, and compare three ways to publish the edge."""
    ours, at = _by_rule()
    stamps = _STAMPS.tolist()
    added = _added_speed(ours.poses, np.array([camera(stamp) for stamp in stamps]), at)
    runs = [Run('wheels only', np.array([wheels(stamp) for stamp in stamps])),
            Run('switch in one message', np.array(
                [wheels(stamp) if stamp <= at else camera(stamp) for stamp in stamps])),
            ours]
    jump = float(runs[1].steps.max())
    return Report(
        tables=[Table(
            'Wheels that slip from 4 s on, beside a camera and a lidar, until 20 s',
            (Column('name', 'odom -> base by'), Column('step_m', 'largest step [cm]', '.1f'),
             Column('turn_rad', 'largest turn [deg]', '.2f'),
             Column('drift_m', 'motion off in the end [m]', '.2f')),
            [(one.name, float(one.steps.max()), one.turned, one.drifted)
             for one in runs])],
        law=f'switching between two messages is a step of {jump:.2f} m, '
            f'or {jump / as_seconds(_STEP):.0f} m/s over the 20 ms between them; '
            f'the blend adds {added:.2f} m/s, of the '
            f'{MAX_SPEED} m/s that are allowed.',
        remarks=[f'The reason of the rule at {as_seconds(at):.2f} s: {ours.reason}.'],
        numbers={'jump_m': jump, 'added_mps': added, 'noticed_s': as_seconds(at - _SLIPS_AT)},
        draw=partial(_draw, runs, at))


def _draw(runs: list[Run], at: int, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    near = abs(_STAMPS - at) <= from_seconds(3.0)
    for one, style in zip(runs, _LINES, strict=True):
        left.plot(*one.poses[near, :2].T, **style, label=one.name)
        right.plot(_STAMPS[1:] / 1e9, one.steps / as_seconds(_STEP), **style)
    x, y = runs[0].poses[at == _STAMPS, :2][0]
    note(left, 'the rule switches', (x, y), (-88, 20), arrowprops={'arrowstyle': '->'})
    left.set(xlabel='x [m]', ylabel='y [m]', title='Path from 3 s before the switch to 3 s after')
    left.set_aspect('equal', adjustable='datalim')
    figure.legend(*left.get_legend_handles_labels(), loc='outside lower center', ncols=3)
    _draw_limits(right, at, runs)


def _draw_limits(axes: Axes, at: int, runs: list[Run]) -> None:
    """Draw the time of the switch, and the limit of the apparent speed."""
    allowed, jump = _SPEED + MAX_SPEED, runs[1].steps.max() / as_seconds(_STEP)
    axes.axhline(allowed, color=GREY, linewidth=0.8)
    note(axes, f'allowed in a blend: {_SPEED:g} + {MAX_SPEED:g} m/s', (13.8, allowed), (0, 4),
         color=GREY, ha='right')
    note(axes, f'in one message: {jump:.0f} m/s', (as_seconds(at), 1.4), (10, 0), va='center',
         color=STYLES[1]['color'])
    note(axes, 'wheels slip', (as_seconds(_SLIPS_AT), 0.72), (-8, 0), va='center', ha='right')
    axes.set(xlabel='time [s]', ylabel='apparent speed [m/s]', ylim=(0.0, 1.5), xlim=(0.0, 14.0),
             title='Speed, as a planner computes it')


# Where runs coincide, the broader line shows on both sides of the thinner one.
_LINES: tuple[dict[str, Any], ...] = (
    {'color': 'black', 'linewidth': 1.2},
    {'color': STYLES[1]['color'], 'linewidth': 4.5, 'alpha': 0.45},
    {'color': STYLES[2]['color'], 'linestyle': '--', 'linewidth': 1.8})
