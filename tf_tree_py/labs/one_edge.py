# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One edge is one line: the lookups that change when a robot's description is edited."""

from collections.abc import Iterator
from functools import partial
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Robot

from .remount import moving, SENSORS
from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'one line of a URDF is edited: which of 1,482 composed lookups change'

_TURN = radians(2.0)
EDIT = Pose.from_xyz_rpy(x=0.01, pitch=_TURN)
"""The change by every edit: the child moves by a centimetre and rotates by two degrees."""

SHOWN = ('odom', 'torso', 'head', 'left_elbow', 'left_hand_camera')
"""The children of the edges whose edits the table shows."""

_FIXED = tuple(SENSORS)
# map -> odom and odom -> pelvis: they slide and turn in a plane; every other joint turns.
_PLANAR = ('odom', 'pelvis')


def description() -> str:
    """Return the humanoid with 38 edges as URDF, with a line for each link and each joint."""
    edges = {**moving(), **SENSORS}
    links = dict.fromkeys(link for edge in edges for link in edge)
    return '\n'.join(['<robot name="humanoid">', *(f'  <link name="{link}"/>' for link in links),
                      *(_line_of(edge, pose) for edge, pose in edges.items()), '</robot>'])


def _line_of(edge: tuple[str, str], origin: Pose) -> str:
    """Return the line of a joint: its links, its origin and its type."""
    parent, child = edge
    joint_type = 'fixed' if edge in _FIXED else 'planar' if child in _PLANAR else 'revolute'
    xyz, rpy = (' '.join(map(repr, numbers)) for numbers in (origin.translation, origin.as_rpy()))
    return (f'  <joint name="{child}" type="{joint_type}"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/></joint>')


def edited(text: str, child: str) -> tuple[str, int]:
    """Return a description with another origin of one child, and the number of that line."""
    lines = text.splitlines()
    number = next(number for number, line in enumerate(lines) if f'<joint name="{child}"' in line)
    joint = next(joint for joint in Robot.parse(text).joints if joint.child == child)
    lines[number] = _line_of(joint.edge, joint.origin @ EDIT)
    return '\n'.join(lines), number + 1


def tree_of(text: str) -> BufferCore:
    """Return the robot's tree, its joints at positions other than zero."""
    robot = Robot.parse(text)
    positions = 0.3 * np.sin(np.arange(len(robot.variables)))
    tree = BufferCore()
    for (parent, child), pose in robot.edges(positions).items():
        tree.insert(parent, child, LATEST, Pose(*pose.tolist()), static=True)
    return tree


def lookups(tree: BufferCore) -> tuple[list[str], Array]:
    """Return the frames, and target_T_source of all pairs: (targets, sources, 7)."""
    frames = sorted(tree.frames())
    answers = [tree.lookup_tree(target) for target in frames]
    return frames, np.array([[answer[source] for source in frames] for answer in answers])


class Edit(NamedTuple):
    """
    The effect of one edited line.

    :ivar below: how many frames are below the edge: its child, and all descendants.
    :ivar crossing: how many lookups have the edge on their path.
    :ivar changed: how many of those return another answer.
    :ivar others: how many lookups without the edge on their path return another answer.
    :ivar off: the largest difference between the changed answers and the old ones with this
        edge replaced by hand, metres.
    :ivar levers: the distance of each frame below from the child, metres.
    :ivar moved: how far each of them moved relative to the frames above, metres.
    """

    edge: tuple[str, str]
    line: int
    below: int
    crossing: int
    changed: int
    others: int
    off: float
    levers: list[float]
    moved: list[float]


def edits() -> Iterator[Edit]:
    """Edit each line, in the original description, and look up all pairs."""
    text = description()
    tree = tree_of(text)
    frames, before = lookups(tree)
    for joint in Robot.parse(text).joints:
        other_text, line = edited(text, joint.child)
        below = np.array([joint.child in tree.frames_between('map', frame) for frame in frames])
        yield _edit(joint.edge, line, frames, below, before, lookups(tree_of(other_text))[1])


def _edit(edge: tuple[str, str], line: int, frames: list[str], below: NDArray[np.bool_],
          before: Array, after: Array) -> Edit:
    parent, child = map(frames.index, edge)
    distances, angles = se3.distance_many(before, after)
    changed = (distances > 1e-9) | (angles > 1e-6)
    crossing = below[:, None] != below[None, :]
    # By hand: the old pose up to the child, the new edge, then the rest as before.
    change = se3.compose_many(before[child, parent], after[parent, child])
    by_hand = se3.compose_many(
        se3.compose_many(before[:, child], change)[:, None], before[child][None, :])
    off, _ = se3.distance_many(by_hand, after)
    return Edit(
        edge, line, int(below.sum()), int(crossing.sum()), int((changed & crossing).sum()),
        int((changed & ~crossing).sum()), float(off[~below][:, below].max()),
        np.linalg.norm(before[child, below, :3], axis=-1).tolist(),
        distances[parent, below].tolist())


def run() -> Report:
    """Edit each of the 38 lines."""
    rows = list(edits())
    frames = len(rows) + 1
    pairs = frames * (frames - 1)
    least, most = (pick(rows, key=lambda row: row.changed) for pick in (min, max))
    off = max(row.off for row in rows)
    everywhere = all(row.changed == row.crossing and not row.others for row in rows)
    return Report(
        tables=[_table(rows, pairs)],
        law=f'an edge with b of the {frames} frames below it is on the way of '
            f'2 b ({frames} - b) of the {pairs:,} lookups; an edit of its line changed '
            f'{"all of those and no others" if everywhere else "OTHERS THAN THOSE"}, for every '
            f'one of the {len(rows)} lines: {least.changed} lookups for {least.edge[1]}, '
            f'{most.changed} for {most.edge[1]}.',
        remarks=['The new answers equal the old ones with that one edge replaced, to '
                 f'{off * 1e15:.1f} fm: no other part of the robot is affected by the edit.',
                 'Each of these lookups is a number that could be copied into a program. All '
                 f'{pairs:,} of them follow from {len(rows)} lines, so only these lines should '
                 'be stored.'],
        numbers={'frames': frames, 'edges': len(rows), 'lookups': pairs,
                 'least_changed': least.changed, 'most_changed': most.changed,
                 'off_m': off, 'as_predicted': everywhere},
        draw=partial(_draw, rows))


def _table(rows: list[Edit], pairs: int) -> Table:
    return Table(
        f'One line of {len(rows)} is edited: the child moves by 1 cm and rotates by 2 degrees',
        (Column('parent', 'parent'), Column('child', 'child'), Column('line', 'line'),
         Column('below', 'frames below'), Column('crossing', 'lookups over it'),
         Column('changed', 'changed'), Column('share', 'of all [%]', '.0f'),
         Column('others', 'others changed'), Column('moved_m', 'moved by up to [cm]', '.1f')),
        [(*row.edge, row.line, row.below, row.crossing, row.changed, row.changed / pairs,
          row.others, max(row.moved)) for row in rows if row.edge[1] in SHOWN])


def _draw(rows: list[Edit], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    frames = len(rows) + 1
    below = np.arange(0, frames + 1)
    left.plot(below, 2 * below * (frames - below), color=GREY, label=f'2 b ({frames} - b)')
    left.plot([row.below for row in rows], [row.changed for row in rows], color='black',
              marker='o', linestyle='none', fillstyle='none', label='an edited line')
    for row, offset in ((row, _OFFSETS[row.edge[1]]) for row in rows if row.edge[1] in _OFFSETS):
        note(left, row.edge[1], (row.below, row.changed), offset)
    left.set(xlabel='frames below the edge, b', ylabel='lookups that changed',
             title=f'Which of {frames * (frames - 1):,} lookups change', ylim=(0.0, 900.0))
    left.legend(loc='lower center')
    _draw_moved(right, [row for row in rows if row.edge[1] in SHOWN])


def _draw_moved(axes: Axes, rows: list[Edit]) -> None:
    """Draw how far each edit moves the frame below it that moves most, and how far away it is."""
    moved = [100.0 * max(row.moved) for row in rows]
    bars = axes.barh(range(len(rows)), moved, 0.5, facecolor='white',
                     edgecolor=STYLES[1]['color'], hatch='////')
    levers = [row.levers[np.argmax(row.moved)] for row in rows]
    axes.bar_label(bars, [f'{most:.1f} cm' + (f' at {lever:.1f} m' if lever > 0.0 else '')
                          for most, lever in zip(moved, levers, strict=True)], padding=4)
    axes.set_yticks(range(len(rows)), [row.edge[1] for row in rows])
    axes.invert_yaxis()
    axes.set(xlabel='motion [cm], and distance from the edge', xlim=(0.0, 2.0 * max(moved)),
             ylabel='edited line', title='Edit by 1 cm and 2°: what moves most')
    axes.grid(axis='y', visible=False)


# The positions of the names of some edges beside their dots.
_OFFSETS = {'odom': (-30, -14), 'torso': (6, 4), 'left_elbow': (8, -3), 'head': (8, -12)}
