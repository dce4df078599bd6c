# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Converts recorded joint states to samples of a robot's edges, for a buffer or a bag."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple
import warnings

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.messages.sample import SampleTrack
from tf_tree_py.core.times import checked_stamp, Stamps

from .joint_states import JointStates
from .motion import Motion
from .robot import Robot


class JointState(NamedTuple):
    """
    The content of one JointState message.

    :ivar stamp: nanoseconds.
    :ivar names: of joints, or of variables of joints that have several.
    :ivar positions: one for each name, metres and radians.
    """

    stamp: int
    names: Sequence[str]
    positions: npt.ArrayLike


def joint_tracks(robot: Robot, states: Iterable[JointState],
                 on_warning: Callable[[str], object] = warnings.warn) -> list[SampleTrack]:
    """
    Return the samples of each edge that joint states move, in the order of the messages.

    The rules are those of the node: a message moves the joints that it names and those that
    mimic them. Joints whose publishers are silent keep their last positions. Fixed joints are
    in ``robot.joints``, with their origins.

    :param states: in the order in which they were received.
    :param on_warning: is called once with each reason why a message cannot be used; by default,
        it is a warning of Python.
    :raises InvalidArgumentException: a stamp is invalid.
    """
    known = JointStates(robot, on_warning)
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
           values: npt.NDArray[np.float64]) -> SampleTrack:
    """Return the samples of one joint. One joint at a time needs less memory."""
    motion = Motion([robot.moving[row]])
    columns = [robot.columns[name] for name in motion.variables]
    return SampleTrack(*robot.moving[row].edge, stamps, motion.poses(values[:, columns])[:, 0])
