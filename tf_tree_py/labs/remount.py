# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A camera is remounted: how many places must change with hard-coded offsets, and with a tree."""

from collections import Counter
from collections.abc import Iterable
from functools import partial
from math import degrees, dist, radians
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.geometry.se3 import distance
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.tree.queries import Queries

from .report import Axes, Column, Figure, GREY, name_ticks, note, Report, STYLES, Table

SUMMARY = 'one camera is remounted: 456 hard-coded places against one edge'

STAMP = from_seconds(1.0)

Edge = tuple[str, str]


class Module(NamedTuple):
    """A perception module: its sensor, its target frame, and the distance of its objects."""

    name: str
    target: str
    sensor: str
    ahead: float


MODULES = (
    Module('object detector', 'map', 'head_camera', 2.0),
    Module('person follower', 'odom', 'head_camera', 4.0),
    Module('gaze control', 'torso', 'head_camera', 1.0),
    Module('visual odometry', 'imu', 'head_camera', 6.0),
    Module('gesture reader', 'right_hand', 'head_camera', 1.5),
    Module('stair detector', 'pelvis', 'chest_camera', 1.2),
    Module('footstep planner', 'left_foot', 'chest_camera', 1.0),
    Module('left grasp', 'torso', 'left_hand_camera', 0.3),
    Module('right grasp', 'torso', 'right_hand_camera', 0.3),
    Module('mapping', 'map', 'lidar', 10.0),
    Module('obstacle layer', 'odom', 'lidar', 3.0),
    Module('lean estimator', 'odom', 'imu', 0.0),
)

REMOUNTED: Edge = ('head', 'head_camera')


def _limb(top: str, names: Iterable[str]) -> list[Edge]:
    """Return the edges of a chain of links below another link."""
    links = [top, *names]
    return list(zip(links, links[1:], strict=False))


def _joints() -> list[Edge]:
    """Return the 30 joints, as parent and child link: a pelvis, a trunk and four limbs."""
    joints = _limb('pelvis', ('waist', 'torso')) + _limb('torso', ('neck', 'head'))
    for side in ('left', 'right'):
        joints += _limb('torso', [f'{side}_{link}' for link in (
            'shoulder', 'upper_arm', 'elbow', 'forearm', 'wrist', 'palm', 'hand')])
        joints += _limb('pelvis', [f'{side}_{link}' for link in (
            'hip', 'groin', 'thigh', 'shin', 'ankle', 'foot')])
    return joints


# Roughly the size of a person; every link continues the one above it.
_LINKS = {'hip': (0.0, 0.1, -0.05), 'shin': (0.0, 0.0, -0.4), 'ankle': (0.0, 0.0, -0.4),
          'torso': (0.0, 0.0, 0.25), 'neck': (0.0, 0.0, 0.3), 'head': (0.0, 0.0, 0.15),
          'shoulder': (0.0, 0.2, 0.2), 'elbow': (0.0, 0.0, -0.3), 'wrist': (0.0, 0.0, -0.25),
          'hand': (0.0, 0.0, -0.1)}

SENSORS: dict[Edge, Pose] = {
    REMOUNTED: Pose.from_xyz_rpy(x=0.08, z=0.06, pitch=radians(10.0)),
    ('torso', 'chest_camera'): Pose.from_xyz_rpy(x=0.12, z=0.1, pitch=radians(35.0)),
    ('left_hand', 'left_hand_camera'): Pose.from_xyz_rpy(x=0.03, z=-0.02),
    ('right_hand', 'right_hand_camera'): Pose.from_xyz_rpy(x=0.03, z=-0.02),
    ('torso', 'lidar'): Pose.from_xyz_rpy(x=0.05, z=0.35),
    ('pelvis', 'imu'): Pose.from_xyz_rpy(x=-0.02, z=0.05),
}
"""The six edges that never move: cameras, lidar and IMU."""

REMOUNT = SENSORS[REMOUNTED] @ Pose.from_xyz_rpy(x=0.02, z=0.03, pitch=radians(5.0))
"""Where the head camera is after it: 2 cm forward, 3 cm up, 5 degrees further down."""


def moving() -> dict[Edge, Pose]:
    """Return the 32 edges that move (localisation, odometry, joints) of the robot at rest."""
    edges = {('map', 'odom'): Pose.from_xyz_rpy(0.3, -0.1, yaw=0.05),
             ('odom', 'pelvis'): Pose.from_xyz_rpy(4.0, 2.0, 0.9, yaw=0.7)}
    for number, (parent, child) in enumerate(_joints()):
        side, _, link = child.rpartition('_')
        x, y, z = _LINKS.get(link, (0.0, 0.0, -0.05 if side else 0.05))
        edges[parent, child] = Pose.from_xyz_rpy(
            x, -y if side == 'right' else y, z, yaw=0.03 * (number % 5 - 2))
    return edges


def humanoid() -> BufferCore:
    """Return the robot before anything is remounted: 38 edges."""
    buffer = BufferCore()
    for (parent, child), pose in moving().items():
        buffer.insert(parent, child, STAMP, pose)
    for (parent, child), pose in SENSORS.items():
        buffer.insert(parent, child, LATEST, pose, static=True)
    return buffer


def way(tree: Queries, module: Module) -> list[Edge]:
    """Return the edges between a module's sensor and its target."""
    return sorted((edge.parent, edge.child)
                  for edge in tree.edges_between(module.target, module.sensor))


class Forgotten(NamedTuple):
    """The error of a module that kept the old offset, at its objects: metres, radians."""

    module: Module
    edges: int
    uses_it: bool
    moved: float
    turned: float


def forgotten(module: Module, before: Queries, after: Queries) -> Forgotten:
    """Compare a module that kept the old offsets with one that uses the tree."""
    old, new = (tree.lookup(module.target, module.sensor) for tree in (before, after))
    sensor_p = (module.ahead, 0.0, 0.0)
    return Forgotten(module, len(way(after, module)), REMOUNTED in way(after, module),
                     dist(old @ sensor_p, new @ sensor_p), distance(old, new)[1])


class Places(NamedTuple):
    """The number of places that hold an offset, and of those that change with the camera."""

    kept: str
    places: int
    change: int


def places(tree: Queries) -> list[Places]:
    """Count the places, by how the modules keep their offsets."""
    ways = [way(tree, module) for module in MODULES]
    users = sum(REMOUNTED in edges for edges in ways)
    everything = len(MODULES) * len(tree.edges())
    return [Places('each module holds all 38 edges', everything, len(MODULES)),
            Places('each module holds the edges it uses', sum(map(len, ways)), users),
            Places('the tree holds them', len(tree.edges()), 1)]


def run() -> Report:
    """Remount the camera, and count."""
    robot = humanoid()
    before = robot.snapshot()
    robot.insert(*REMOUNTED, LATEST, REMOUNT, static=True)
    counts = places(robot)
    rows = [forgotten(module, before, robot) for module in MODULES]
    worst = max(rows, key=lambda row: row.moved)
    edges = Counter('static' if edge.static else 'moving' for edge in robot.edges())
    return Report(
        tables=[_places_table(counts), _forgotten_table(rows)],
        law=f'{len(MODULES)} modules that each hold {len(robot.edges())} edges are '
            f'{counts[0].places} places, and a remounted camera changes {counts[0].change} of '
            f'them (if each holds only what it uses, {counts[1].change} of {counts[1].places}); '
            f'in a tree it changes {counts[2].change}. Forget one, and it is off by '
            f'{degrees(worst.turned):.1f} degrees, which is up to '
            f'{worst.moved * 100.0:.0f} cm at its objects.',
        remarks=[f'Of the {len(robot.edges())} edges {edges["static"]} are static. The other '
                 f'{edges["moving"]} move, so they cannot be hard-coded: real programs keep '
                 'copies of the origins of the joints, and of the poses of the sensors.'],
        numbers={'edges': len(robot.edges()), 'static_edges': edges['static'],
                 'modules': len(MODULES), 'places': counts[0].places,
                 'places_changed': counts[0].change, 'places_used': counts[1].places,
                 'places_used_changed': counts[1].change, 'tree_changed': counts[2].change,
                 'worst_m': worst.moved, 'worst_rad': worst.turned},
        draw=partial(_draw, counts, rows))


def _places_table(counts: list[Places]) -> Table:
    return Table(
        'Places that hold an offset, and those that the remounted head camera changes',
        (Column('kept', 'where offsets are kept'), Column('places', 'places'),
         Column('change', 'to change')), counts)


def _forgotten_table(rows: list[Forgotten]) -> Table:
    return Table(
        'The error of a module that is forgotten',
        (Column('module', 'module'), Column('target', 'target'), Column('sensor', 'sensor'),
         Column('ahead_m', 'looks ahead [m]', '.1f'), Column('edges', 'edges'),
         Column('uses_it', 'remounted'), Column('moved_m', 'off by [cm]', '.1f'),
         Column('turned_rad', 'turned by [deg]', '.1f')),
        [(*row.module, row.edges, row.uses_it, row.moved, row.turned) for row in rows])


def _draw(counts: list[Places], rows: list[Forgotten], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    heights = np.arange(len(counts))
    # A logarithmic axis shows 1 beside 456. It has no zero, so there are dots instead of bars.
    left.hlines(heights, [count.change for count in counts], [count.places for count in counts],
                color=GREY, linewidth=1.0)
    for key, fill, label in (('places', 'none', 'places that hold an offset'),
                             ('change', 'full', 'places to change')):
        numbers = [getattr(count, key) for count in counts]
        left.plot(numbers, heights, color='black', linestyle='none', marker='o', markersize=8.0,
                  fillstyle=fill, label=label)
        for height, number in zip(heights, numbers, strict=True):
            note(left, f'{number}', (number, height), (0, 9), ha='center')
    left.set_yticks(heights, ['each module\nholds all', 'each module\nholds what\nit uses',
                              'the tree'])
    left.set_xscale('log')
    name_ticks(left, (1, 10, 100, 1000))
    left.set(xlabel='places in the code', xlim=(0.6, 1500.0), ylim=(2.5, -1.3),
             title='One camera is remounted: what to change')
    left.grid(axis='y', visible=False)
    left.legend(loc='upper right')
    _draw_forgotten(right, [row for row in rows if row.uses_it])


def _draw_forgotten(axes: Axes, rows: list[Forgotten]) -> None:
    heights = np.arange(len(rows))
    bars = axes.barh(heights, [row.moved * 100.0 for row in rows], facecolor='white',
                     hatch='////', edgecolor=STYLES[1]['color'])
    axes.bar_label(bars, fmt='%.1f cm', padding=4)
    axes.set_yticks(
        heights, [f'{row.module.name}\n({row.module.ahead:g} m ahead)' for row in rows])
    axes.invert_yaxis()
    axes.set(xlabel='error at its target [cm]', xlim=(0.0, 65.0),
             title=f'A camera turned by {degrees(rows[0].turned):.1f}°')
    axes.grid(axis='y', visible=False)
