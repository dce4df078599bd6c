# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The direction of a transform: invert it, do not transpose it; and a check for mistakes."""

from collections.abc import Callable, Sequence
from functools import partial
from math import hypot, pi, radians
from operator import matmul
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'the way back is the inverse, not the transpose; "is it in front of me?"'

BASE_T_CAMERA = Pose.from_xyz_rpy(x=0.2, z=0.8)
# Ahead of the camera, and a little to the left.
CAMERA_P = (2.0, 0.3, 0.0)
_STAMP = from_seconds(1.0)
_TRIALS = 500


def is_in_front(robot_T_source: Pose, source_p: Sequence[float] | Array,
                forward: Sequence[float] = (1.0, 0.0, 0.0)) -> bool:
    """
    Return whether a point lies ahead of the robot, which reveals a swapped lookup.

    A camera that points forward sees nothing behind the robot. Transform its point to the
    required frame, such as map. Then call this with ``lookup('base_link', 'map')`` and the
    point in the map. False means that one of the lookups had its arguments swapped.

    :param robot_T_source: takes the point to the robot's frame.
    :param source_p: (3,), metres.
    :param forward: the robot's axis that points ahead; z for an optical frame.
    """
    return bool((robot_T_source @ np.asarray(source_p, dtype=float)) @ np.asarray(forward) > 0.0)


def robot_at(map_T_base: Pose) -> BufferCore:
    """Return map -> base_link -> camera."""
    buffer = BufferCore()
    buffer.insert('map', 'base_link', _STAMP, map_T_base)
    buffer.insert('base_link', 'camera', LATEST, BASE_T_CAMERA, static=True)
    return buffer


# What programs compute from camera_T_map to obtain a point of the camera in the map.

def _transposed(camera_T_map: Pose, camera_p: Sequence[float]) -> Array:
    """Use the transpose of the whole 4 x 4 matrix, and the first three numbers of the product."""
    return (camera_T_map.as_matrix().T @ [*camera_p, 1.0])[:3]


def _negated(camera_T_map: Pose, camera_p: Sequence[float]) -> Array:
    """Rotate back, but subtract a translation whose coordinates are the camera's."""
    matrix = camera_T_map.as_matrix()
    return matrix[:3, :3].T @ camera_p - matrix[:3, 3]


WAYS: dict[str, Callable[[Pose, Sequence[float]], Array]] = {
    'the inverse': lambda camera_T_map, camera_p: camera_T_map.inverse() @ camera_p,
    'none, the arguments swapped': matmul,
    'the 4 x 4 matrix transposed': _transposed,
    'R transposed, t negated': _negated,
}


class Outcome(NamedTuple):
    """
    The results of one way of inverting, on one pose and on many.

    :ivar map_p: the resulting point for the robot of the picture.
    :ivar error: its distance from the true point, metres.
    :ivar behind: for how many of 500 random poses the point lies behind the robot.
    :ivar other_range: for how many its distance differs from the measured one.
    """

    way: str
    map_p: Array
    error: float
    behind: float
    other_range: float


def outcome(way: str, map_T_base: Pose) -> Outcome:
    """Invert in one way: the given pose, and random ones."""
    buffer = robot_at(map_T_base)
    map_p = np.asarray(WAYS[way](buffer.lookup('camera', 'map'), CAMERA_P))
    truth = buffer.lookup('map', 'camera') @ CAMERA_P
    random = np.random.default_rng(1)
    behind = other_range = 0
    for _ in range(_TRIALS):
        x, y, yaw = random.uniform((-10.0, -10.0, -pi), (10.0, 10.0, pi)).tolist()
        buffer = robot_at(Pose.from_xyz_rpy(x=x, y=y, yaw=yaw))
        seen = WAYS[way](buffer.lookup('camera', 'map'), CAMERA_P)
        behind += not is_in_front(buffer.lookup('base_link', 'map'), seen)
        camera_p = buffer.lookup('camera', 'map') @ seen
        other_range += abs(hypot(*camera_p) - hypot(*CAMERA_P)) > 0.01
    return Outcome(way, map_p, float(np.linalg.norm(map_p - truth)), behind / _TRIALS,
                   other_range / _TRIALS)


def run() -> Report:
    """Invert in all ways, and count the mistakes that the check finds."""
    map_T_base = Pose.from_xyz_rpy(x=3.0, y=1.0, yaw=radians(30.0))
    outcomes = [outcome(way, map_T_base) for way in WAYS]
    swapped = outcomes[1]
    buffer = robot_at(map_T_base)
    unit = buffer.lookup('map', 'camera') @ buffer.lookup('camera', 'map')
    return Report(
        tables=[Table(
            f'A point that the camera sees at {CAMERA_P}, taken to the map with camera_T_map and '
            '...',
            (Column('way', '... this'), Column('map_p_m', 'gives [m]'),
             Column('error_m', 'error [m]', '.3f'),
             Column('behind', 'behind the robot [%]', '.0f'),
             Column('other_range', 'at another distance [%]', '.0f')),
            [(row.way, '({:.2f}, {:.2f}, {:.2f})'.format(*row.map_p), row.error, row.behind,
              row.other_range) for row in outcomes])],
        law='lookup(target, source) takes coordinates in the source to coordinates in the '
            'target, and the way back is the inverse (R^T, -R^T t), not a transpose: swapped '
            f'arguments put the point {swapped.error:.2f} m off here, and behind the robot on '
            f'{swapped.behind:.0%} of {_TRIALS} random poses, where is_in_front() finds it.',
        remarks=[
            f'map_T_camera camera_T_map = {unit}: the two lookups are inverses of each other.',
            'A single point reveals a swapped lookup in less than half of all cases, because a '
            'wrong point may lie ahead by chance. Check poses that face in different directions, '
            'or compare the distance as well: the camera measured it, and no correct transform '
            'changes it.'],
        numbers={row.way: {'error_m': row.error, 'behind': row.behind,
                           'other_range': row.other_range} for row in outcomes},
        draw=partial(_draw, outcomes, map_T_base))


def _draw(outcomes: list[Outcome], map_T_base: Pose, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    _draw_places(left, outcomes, map_T_base)
    heights = np.arange(len(outcomes))
    for share, shift, hatch, colour, label in (
            ('behind', -0.19, '////', STYLES[1]['color'], 'the point is behind the robot'),
            ('other_range', 0.19, 'xx', STYLES[2]['color'], 'its distance has changed')):
        bars = right.barh(
            heights + shift, [getattr(row, share) * 100.0 for row in outcomes], 0.36,
            facecolor='white', edgecolor=colour, hatch=hatch, label=label)
        right.bar_label(bars, ['' if row.error < 1e-9 else f'{100.0 * getattr(row, share):.0f} %'
                               for row in outcomes], padding=3)
    note(right, '0 %: right at every pose', (0.0, 0.0), (6, 0), va='center')
    right.set_yticks(heights, [row.way.replace(', ', ',\n').replace('matrix ', 'matrix\n')
                               for row in outcomes])
    right.set(xlabel=f'share of {_TRIALS} random poses [%]',
              xlim=(0.0, 128.0), ylim=(len(outcomes) - 0.5, -1.5), xticks=range(0, 101, 20),
              title='How often two checks notice the mistake')
    right.grid(axis='y', visible=False)
    right.legend(loc='upper right')


def _draw_places(axes: Axes, outcomes: list[Outcome], map_T_base: Pose) -> None:
    # The half-plane behind the robot: everything with a negative x in its frame.
    behind = map_T_base @ [(0.0, 20.0, 0.0), (0.0, -20.0, 0.0), (-20.0, -20.0, 0.0),
                           (-20.0, 20.0, 0.0)]
    axes.fill(behind[:, 0], behind[:, 1], facecolor='#e9e9e9', edgecolor=GREY, linewidth=1.0)
    corners = map_T_base @ [(0.5, 0.0, 0.0), (-0.3, 0.3, 0.0), (-0.3, -0.3, 0.0), (0.5, 0.0, 0.0)]
    axes.plot(corners[:, 0], corners[:, 1], color='black')
    note(axes, 'robot', map_T_base.translation[:2], (12, 12))
    axes.plot(0.0, 0.0, marker='+', color='black', markersize=12)
    note(axes, 'map', (0.0, 0.0), (8, -12), bbox=_PAPER)
    axes.annotate('behind the robot', (-2.9, 2.9), bbox=_PAPER)
    axes.annotate('in front', (3.3, 3.2))
    for row, marker in zip(outcomes, 'oXsD', strict=True):
        axes.plot(*row.map_p[:2], marker=marker, color='black', linestyle='none',
                  markersize=8, label=row.way, fillstyle='full' if marker == 'o' else 'none')
    axes.set(xlabel='x in map [m]', ylabel='y in map [m]', aspect='equal', xlim=(-3.2, 6.2),
             ylim=(-2.3, 7.2), title='Where each formula puts the point')
    axes.legend(loc='upper left', framealpha=1.0)


# A background for words that stand on lines.
_PAPER = {'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.5}
