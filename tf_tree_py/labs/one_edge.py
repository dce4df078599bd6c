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

"""One edge is one line: which lookups change when a line of a robot's description is edited."""

from collections.abc import Iterator
from functools import partial
from math import radians, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tf_tree_py.core import BufferCore, LATEST, Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Robot

from .pictures import GREY, STYLES
from .remount import moving, SENSORS
from .report import Column, Report, Table

SUMMARY = 'one line of a URDF is edited: which of 1,482 composed lookups change'

_TURN = radians(2.0)
EDIT = Pose.from_xyz_rpy(x=0.01, pitch=_TURN)
"""What every edit does: the child is a centimetre further on, and turned by two degrees."""

SHOWN = ('odom', 'torso', 'head', 'left_elbow', 'left_hand_camera')
"""The children of the edges whose edits the table shows."""

_FIXED = tuple(SENSORS)
# map -> odom and odom -> pelvis: they slide and turn in a plane; every other joint turns.
_PLANAR = ('odom', 'pelvis')


def description() -> str:
    """Return the humanoid with 38 edges as URDF, a line for each link and each joint."""
    edges = {**moving(), **SENSORS}
    links = dict.fromkeys(link for edge in edges for link in edge)
    return '\n'.join(['<robot name="humanoid">', *(f'  <link name="{link}"/>' for link in links),
                      *(line_of(edge, pose) for edge, pose in edges.items()), '</robot>'])


def line_of(edge: tuple[str, str], origin: Pose) -> str:
    """Return the line that says where a link hangs on another, and how it moves there."""
    parent, child = edge
    kind = 'fixed' if edge in _FIXED else 'planar' if child in _PLANAR else 'revolute'
    xyz, rpy = (' '.join(map(repr, numbers)) for numbers in (origin.translation, origin.as_rpy()))
    return (f'  <joint name="{child}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/></joint>')


def edited(text: str, child: str) -> tuple[str, int]:
    """Return a description with another origin of one child, and the number of that line."""
    lines = text.splitlines()
    number = next(number for number, line in enumerate(lines) if f'<joint name="{child}"' in line)
    joint = next(joint for joint in Robot.parse(text).joints if joint.child == child)
    lines[number] = line_of(joint.edge, joint.origin @ EDIT)
    return '\n'.join(lines), number + 1


def tree_of(text: str) -> BufferCore:
    """Return the robot's tree, its joints at positions other than zero."""
    robot = Robot.parse(text)
    positions = 0.3 * np.sin(np.arange(len(robot.variables)))
    tree = BufferCore()
    for (parent, child), pose in robot.edges(positions).items():
        tree.insert(parent, child, LATEST, pose, static=True)
    return tree


def lookups(tree: BufferCore) -> tuple[list[str], Array]:
    """Return the frames, and target_T_source of all pairs: (targets, sources, 7)."""
    frames = sorted(tree.frames())
    answers = [tree.lookup_tree(target) for target in frames]
    return frames, np.array([[answer[source] for source in frames] for answer in answers])


class Edit(NamedTuple):
    """
    What one edited line does.

    :ivar below: how many frames hang on the edge: its child, and what hangs on that.
    :ivar crossing: how many lookups have the edge on their way.
    :ivar changed: how many of those give another answer.
    :ivar others: how many that do not have it on their way give another answer.
    :ivar off: how far the changed answers are at most from the old ones with this one edge
        exchanged by hand, metres.
    :ivar levers: how far each frame below is from the child, metres.
    :ivar moved: how far each of them moved, as the frames above see it, metres.
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
    """Edit one line after the other, each in the description as it was, and ask for all pairs."""
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
    # By hand: to the child as before, then what this edge has become, then on as before.
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
        remarks=['The new answers are the old ones with that one edge exchanged, to '
                 f'{off * 1e15:.1f} fm: nobody else has to know of the edit.',
                 'Each of these lookups is a number that somebody may have copied into a program. '
                 f'The {pairs:,} of them follow from {len(rows)} lines, and so nothing but the '
                 'lines is worth keeping.'],
        numbers={'frames': frames, 'edges': len(rows), 'lookups': pairs,
                 'least_changed': least.changed, 'most_changed': most.changed,
                 'off_m': off, 'as_predicted': everywhere},
        draw=partial(_draw, rows))


def _table(rows: list[Edit], pairs: int) -> Table:
    return Table(
        f'One line of {len(rows)} is edited: the child 1 cm further on, turned by 2 degrees',
        (Column('parent', 'parent'), Column('child', 'child'), Column('line', 'line'),
         Column('below', 'frames below'), Column('crossing', 'lookups over it'),
         Column('changed', 'changed'), Column('share', 'of all [%]', '.0f', 100.0),
         Column('others', 'others changed'),
         Column('moved_m', 'moved by up to [cm]', '.1f', 100.0)),
        [(*row.edge, row.line, row.below, row.crossing, row.changed, row.changed / pairs,
          row.others, max(row.moved)) for row in rows if row.edge[1] in SHOWN])


def _draw(rows: list[Edit], figure: Any) -> None:
    left, right = figure.subplots(1, 2)
    frames = len(rows) + 1
    below = np.arange(0, frames + 1)
    left.plot(below, 2 * below * (frames - below), color=GREY, label=f'2 b ({frames} - b)')
    left.plot([row.below for row in rows], [row.changed for row in rows], color='black',
              marker='o', linestyle='none', fillstyle='none', label='an edited line')
    for row, offset in ((row, _OFFSETS[row.edge[1]]) for row in rows if row.edge[1] in _OFFSETS):
        left.annotate(row.edge[1], (row.below, row.changed), offset, textcoords='offset points')
    left.set(xlabel='frames below the edge, b', ylabel='lookups that changed',
             title=f'Which of {frames * (frames - 1):,} lookups change', ylim=(0.0, 900.0))
    left.legend(loc='lower center')
    levers = np.array([0.0, 5.2])
    right.plot(levers, 2.0 * levers * sin(_TURN / 2.0) * 100.0 + 1.0,
               **{**STYLES[1], 'marker': ''}, label='1 cm + 2 r sin(1°), at most')
    right.plot([lever for row in rows for lever in row.levers],
               [moved * 100.0 for row in rows for moved in row.moved],
               color='black', marker='.', linestyle='none', label='a frame below an edited line')
    right.set(xlabel='from the edited joint, r [m]', ylabel='moved by [cm]',
              title='1 cm further, and turned by 2°')
    right.legend(loc='upper left')


# Where the names of some edges stand beside their dots.
_OFFSETS = {'odom': (-30, -14), 'torso': (6, 4), 'left_elbow': (8, -3), 'head': (8, -12)}
