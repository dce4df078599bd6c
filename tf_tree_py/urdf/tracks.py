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

"""Recorded joint states as the samples of a robot's edges, for a buffer or a bag."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple
import warnings

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.arrivals.track import Track
from tf_tree_py.core.times import checked_stamp, Stamps

from .motion import Motion
from .robot import Robot
from .states import JointStates


class JointState(NamedTuple):
    """
    What one message says of some joints.

    :ivar stamp: nanoseconds.
    :ivar names: of joints, or of variables of joints that have several.
    :ivar positions: one for each name, metres and radians.
    """

    stamp: int
    names: Sequence[str]
    positions: npt.ArrayLike


def joint_tracks(robot: Robot, states: Iterable[JointState],
                 tell: Callable[[str], object] = warnings.warn) -> list[Track]:
    """
    Return the samples of every edge that joint states move, in the order of the messages.

    By the rules of the node: a message moves the joints that it names and those that mimic
    them, and of the others those that nobody reports any more stay where they were. What
    does not move is in ``robot.joints``, with its origin.

    :param states: in the order in which they came; stamps are what a buffer takes.
    :param tell: hears in a sentence what cannot be used, each once; warns unless given.
    :raises InvalidArgumentException: a stamp that is none.
    """
    known = JointStates(robot, tell)
    stamps, values, sent = [], [], []
    for when, names, positions in states:
        stamp = checked_stamp(when)
        rows = known.take(stamp, tuple(names), np.asarray(positions, float))
        if rows is not None:
            stamps.append(stamp)
            values.append(known.values)
            sent.append(rows)
    if not stamps:
        return []
    all_stamps, all_values = np.array(stamps, np.int64), np.array(values)
    moved = np.array(sent).T
    return [_track(robot, row, all_stamps[when], all_values[when])
            for row, when in enumerate(moved) if when.any()]


def _track(robot: Robot, row: int, stamps: Stamps,
           values: npt.NDArray[np.float64]) -> Track:
    """Return the samples of one joint: one after the other, they take less memory at a time."""
    motion = Motion([robot.moving[row]])
    columns = [robot.columns[name] for name in motion.variables]
    return Track(*robot.moving[row].edge, stamps, motion.poses(values[:, columns])[:, 0])
