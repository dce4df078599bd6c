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

"""
The robots and how they move: the same numbers for every contestant.

Standard library only, for a contestant in another Python imports this too.
"""

import math
from typing import NamedTuple

Pose = tuple[float, float, float, float, float, float, float]

START = 10_000_000_000
PERIOD = 10_000_000  # 100 Hz

_AXES = [(0.6, 0.0, 0.8), (0.8, 0.6, 0.0), (0.0, -0.8, 0.6), (0.48, -0.6, 0.64)]


class Edge(NamedTuple):
    """
    An edge; its number makes its motion its own.

    :ivar offset: how much later than others it is sampled, nanoseconds.
    """

    parent: str
    child: str
    static: bool
    number: int
    offset: int = 0

    def stamp_of(self, sample: int) -> int:
        """Return when a sample is taken, nanoseconds."""
        return START + self.offset + sample * PERIOD


class Robot(NamedTuple):
    """
    A tree of frames, and the two that are asked about.

    :ivar edges: parents before children.
    """

    edges: list[Edge]
    target: str
    source: str

    @property
    def moving(self) -> list[Edge]:
        """Return the edges on the way from target to source that move."""
        by_child = {edge.child: edge for edge in self.edges}
        way = []
        frame = self.source
        while frame != self.target:
            way.append(by_child[frame])
            frame = way[-1].parent
        return [edge for edge in reversed(way) if not edge.static]


def pose_at(edge: Edge, stamp: int) -> Pose:
    """Return ``parent_T_child``: x y z, quaternion x y z w. It turns by up to 1.7 rad/s."""
    t = 0.0 if edge.static else (stamp - START) / 1e9
    phase = 0.7 * edge.number
    angle = phase + 0.3 * t + 0.8 * math.sin(1.7 * t + phase)
    ax, ay, az = _AXES[edge.number % len(_AXES)]
    sine = math.sin(angle / 2.0)
    return (0.3 * math.sin(t + phase), 0.2 * math.cos(1.3 * t + phase), 0.1 + 0.05 * t,
            ax * sine, ay * sine, az * sine, math.cos(angle / 2.0))


def chain(depth: int, staggered: bool = False) -> Robot:
    """
    Return frames hanging on each other, all of them moving.

    :param staggered: no two are sampled at the same time.
    """
    edges = [Edge(f'frame_{i}', f'frame_{i + 1}', False, i, staggered * i * PERIOD // depth)
             for i in range(depth)]
    return Robot(edges, 'frame_0', f'frame_{depth}')


def humanoid() -> Robot:
    """
    Return 38 edges: 30 joints, 4 cameras, a lidar, an IMU, map->odom, odom->base.

    A joint is a pair of links, fixed ones too, as a URDF has them. The hand camera
    hangs 12 edges below the map; 5 of those move.
    """
    edges = [Edge(parent, child, kind == 'fixed', number)
             for number, (parent, child, kind) in enumerate(_humanoid_links())]
    return Robot(edges, 'map', 'left_hand_camera')


def robot(name: str) -> Robot:
    """Return a robot by name: 'humanoid', 'chain5', 'staggered3'."""
    if name == 'humanoid':
        return humanoid()
    kind = name.rstrip('0123456789')
    return chain(int(name[len(kind):]), staggered=kind == 'staggered')


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
    for joint, kind in joints.items():
        links.append((parent, f'{side}_{joint}', kind))
        parent = f'{side}_{joint}'
    return links


_ARM = {'shoulder_mount': 'fixed', 'shoulder': 'moves', 'upper_arm': 'fixed',
        'elbow': 'moves', 'forearm': 'fixed', 'hand': 'fixed'}
_LEG = {'hip_yaw': 'moves', 'hip_roll': 'moves', 'hip_pitch': 'moves',
        'knee': 'moves', 'ankle_pitch': 'moves', 'ankle_roll': 'moves'}
