# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The robots and their motion: the same numbers for every contestant.

Uses the standard library only, because a contestant in another Python also imports this module.
"""

import math
from typing import NamedTuple

Pose = tuple[float, float, float, float, float, float, float]

START = 10_000_000_000
PERIOD = 10_000_000  # 100 Hz
# A time of these years, nanoseconds, so that positions stay precise.
_NEAR = 1_800_000_000 * 10**9

_AXES = [(0.6, 0.0, 0.8), (0.8, 0.6, 0.0), (0.0, -0.8, 0.6), (0.48, -0.6, 0.64)]


class Edge(NamedTuple):
    """
    An edge.

    :ivar number: determines the motion, which is different for each edge.
    :ivar offset: how much later than others it is sampled, nanoseconds.
    """

    parent: str
    child: str
    static: bool
    number: int
    offset: int = 0

    def stamp_of(self, sample: int) -> int:
        """Return the stamp of a sample, nanoseconds."""
        return START + self.offset + sample * PERIOD


class Robot(NamedTuple):
    """
    A tree of frames, and the two frames of its lookups.

    :ivar edges: parents before children.
    """

    edges: list[Edge]
    target: str
    source: str

    @property
    def moving(self) -> list[Edge]:
        """Return the moving edges on the path from target to source."""
        by_child = {edge.child: edge for edge in self.edges}
        way = []
        frame = self.source
        while frame != self.target:
            way.append(by_child[frame])
            frame = way[-1].parent
        return [edge for edge in reversed(way) if not edge.static]


def pose_at(edge: Edge, stamp: int) -> Pose:
    """Return ``parent_T_child``: x y z, quaternion x y z w. It rotates by up to 1.7 rad/s."""
    t = 0.0 if edge.static else (stamp - START) / 1e9
    phase = 0.7 * edge.number
    angle = phase + 0.3 * t + 0.8 * math.sin(1.7 * t + phase)
    ax, ay, az = _AXES[edge.number % len(_AXES)]
    sine = math.sin(angle / 2.0)
    return (0.3 * math.sin(t + phase), 0.2 * math.cos(1.3 * t + phase), 0.1 + 0.05 * t,
            ax * sine, ay * sine, az * sine, math.cos(angle / 2.0))


def steady_pose(stamp: int) -> Pose:
    """Return a pose that moves at 0.1 m/s: interpolation is exact over any gap."""
    return 1e-10 * (stamp - _NEAR), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0


def chain(depth: int, staggered: bool = False) -> Robot:
    """
    Return a serial chain of moving frames.

    :param staggered: no two edges are sampled at the same time.
    """
    edges = [Edge(f'frame_{i}', f'frame_{i + 1}', False, i, staggered * i * PERIOD // depth)
             for i in range(depth)]
    return Robot(edges, 'frame_0', f'frame_{depth}')


def wide(frames: int) -> Robot:
    """
    Return a chain of five edges, with further moving frames at its root.

    :param frames: number in the tree, the root included.
    """
    spine = chain(5)
    root = spine.target
    extra = [Edge(root, f'beside_{number}', False, number)
             for number in range(len(spine.edges), frames - 1)]
    return spine._replace(edges=spine.edges + extra)


def humanoid() -> Robot:
    """
    Return 38 edges: 30 joints, 4 cameras, a lidar, an IMU, map->odom, odom->base.

    A joint is a pair of links, fixed joints included, as in a URDF. The hand camera
    is 12 edges below the map; 5 of those move.
    """
    edges = [Edge(parent, child, joint_type == 'fixed', number)
             for number, (parent, child, joint_type) in enumerate(_humanoid_links())]
    return Robot(edges, 'map', 'left_hand_camera')


def robot(name: str) -> Robot:
    """Return a robot by name: 'humanoid', 'chain5', 'staggered3', 'wide100'."""
    if name == 'humanoid':
        return humanoid()
    shape = name.rstrip('0123456789')
    number = int(name[len(shape):])
    return wide(number) if shape == 'wide' else chain(number, staggered=shape == 'staggered')


def _humanoid_links() -> list[tuple[str, str, str]]:
    links = [
        ('map', 'odom', 'moves'),
        ('odom', 'base', 'moves'),
        ('base', 'pelvis', 'fixed'),
        ('pelvis', 'waist', 'moves'),
        ('waist', 'chest', 'fixed'),
        ('chest', 'neck', 'moves'),
        ('neck', 'head', 'moves'),
    ]
    for side in 'left', 'right':
        links += _limb(side, 'chest', _ARM)
    for side in 'left', 'right':
        links += _limb(side, 'pelvis', _LEG)
    links.append(('left_hand', 'left_finger', 'moves'))
    sensors = {'left_hand_camera': 'left_hand', 'right_hand_camera': 'right_hand',
               'head_camera': 'head', 'chest_camera': 'chest', 'lidar': 'chest', 'imu': 'pelvis'}
    return links + [(parent, sensor, 'fixed') for sensor, parent in sensors.items()]


def _limb(side: str, parent: str, joints: dict[str, str]) -> list[tuple[str, str, str]]:
    links = []
    for joint, joint_type in joints.items():
        links.append((parent, f'{side}_{joint}', joint_type))
        parent = f'{side}_{joint}'
    return links


_ARM = {'shoulder_mount': 'fixed', 'shoulder': 'moves', 'upper_arm': 'fixed',
        'elbow': 'moves', 'forearm': 'fixed', 'hand': 'fixed'}
_LEG = {'hip_yaw': 'moves', 'hip_roll': 'moves', 'hip_pitch': 'moves',
        'knee': 'moves', 'ankle_pitch': 'moves', 'ankle_roll': 'moves'}
