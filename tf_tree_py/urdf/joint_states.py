# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The joint states of a robot as they arrive: the known positions, and the edges to send.

Recorded ones are converted to samples of a robot's edges, for a buffer or a bag.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import warn
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.sample import SampleTrack
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.text import known_names
from tf_tree_py.core.times import checked_stamp, Stamps

from .joints import FIXED, followers, Motion
from .robot import Robot
from .robot_xml import listed, quoted

Rows = npt.NDArray[np.bool_]

# A joint is regular if its reports follow each other within _PATIENCE. It is silent after so many
# of its periods without a report, and after _PATIENCE at the latest.
_PERIODS = 3
_PATIENCE = NANOSECONDS_PER_SECOND
# A stamp that is earlier by more than this belongs to a new run.
_ANOTHER_RUN = NANOSECONDS_PER_SECOND
# The greatest number of lists of names, and of warnings of a recording, to remember.
_MAX_REMEMBERED = 256
# Earlier than every valid stamp, and far enough from overflow.
_NEVER = -2**62


class Reading:
    """
    The meaning of a message's list of names for a robot.

    :ivar unknown: the names that the robot does not have.
    :ivar picks: indices of the positions to read.
    :ivar columns: the variables that these positions set.
    :ivar followers: the variables that mimic them.
    :ivar rows: whether each of the moving joints moves, directly or because it mimics another.
    :ivar moves: whether any joint moves.
    :ivar moves_all: whether all joints move.
    """

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        """Look the names up; of two equal names, the first counts."""
        places = {name: place for place, name in reversed(list(enumerate(names)))}
        known = {name: place for name, place in places.items() if name in robot.columns}
        # Some publishers also list fixed joints, which is valid.
        fixed = {joint.name for joint in robot.joints if joint.joint_type == FIXED}
        self.unknown = [name for name in places if name not in known and name not in fixed]
        self.picks = np.array(list(known.values()), np.intp)
        self.columns = np.array([robot.columns[name] for name in known], np.intp)
        self.followers = followers(robot.moving, known, robot.columns)
        reached = {*self.columns.tolist(), *self.followers.columns.tolist()}
        self.rows = np.array([any(robot.columns[name] in reached for name in joint.variables)
                              for joint in robot.moving], bool)
        self.moves = bool(self.rows.any())
        self.moves_all = bool(self.rows.all())


class JointStates:
    """
    The last position of each joint, and the edges to send.

    A message moves the joints that it names and those that mimic them. Other joints keep their
    last positions. Such a joint is sent too if its own publisher is silent. While its publisher
    reports it regularly, the joint is not sent, because its old position would be wrong.

    :ivar values: (variables,) of all moving joints, metres and radians.
    """

    def __init__(self, robot: Robot, on_warning: Callable[[str, str], object]) -> None:
        """
        Begin with all joints at rest and none reported.

        :param on_warning: is called whenever a message cannot be used, with the kind of reason,
            and a sentence. For names that the robot does not have, it is called once for each of
            the last lists of names.
        """
        self._robot, self._on_warning = robot, on_warning
        self._readings: dict[tuple[str, ...], Reading] = {}
        self.values = robot.rest.copy()
        self._given = np.zeros(len(self.values), bool)
        # By joint: the stamp of the last report, the time since the report before it, and the
        # stamp at which the joint was sent last.
        joints = len(robot.moving)
        self._reported = np.full(joints, _NEVER, np.int64)
        self._gaps = np.zeros(joints, np.int64)
        self._sent = np.full(joints, _NEVER, np.int64)

    def update(self, stamp: int, names: tuple[str, ...], positions: Array,
               interval: int | None = None) -> Rows | None:
        """
        Update by a message, and return which of the moving joints to send with its stamp.

        :param stamp: of the message, nanoseconds.
        :param names: of joints, or of variables of joints that have several.
        :param positions: one for each name, metres and radians.
        :param interval: the least time between two messages of a joint, nanoseconds; None: no
            limit.
        :return: (moving joints,) whether to send each; None: there is nothing to send.
        """
        if positions.shape != (len(names),):
            self._on_warning('names without positions', (
                f'joint states with {len(names)} names and {positions.size} positions are '
                'ignored'))
            return None
        reading = self._reading(names)
        given = positions[reading.picks]
        finite = np.isfinite(given)
        if not finite.all():
            bad = reading.picks[~finite]
            self._on_warning('positions that are not finite', (
                'positions that are not finite are ignored, of '
                + listed(quoted(names[place]) for place in bad)))
            good = np.setdiff1d(np.arange(len(names)), bad)
            return self.update(stamp, tuple(names[place] for place in good), positions[good],
                               interval)
        if not reading.moves or not self._set(reading, given):
            return None
        rows = self._report(stamp, reading)
        if interval is not None and not self._is_due(stamp, reading.rows, interval):
            return None
        self._sent[rows] = stamp
        return rows

    def _reading(self, names: tuple[str, ...]) -> Reading:
        reading = self._readings.get(names)
        if reading is None:
            reading = Reading(self._robot, names)
            if len(self._readings) >= _MAX_REMEMBERED:
                self._readings.clear()
            self._readings[names] = reading
            if reading.unknown:
                self._on_warning('unknown joints', (
                    'joint states name joints that this robot does not have: '
                    f'{listed(map(quoted, reading.unknown))}. '
                    + known_names(reading.unknown[0], tuple(self._robot.columns))))
        return reading

    def _set(self, reading: Reading, given: Array) -> bool:
        """Set the given variables and those that mimic them; return whether that is possible."""
        values = self.values.copy()
        values[reading.columns] = given
        if not self._robot.motion.has_turns(values):
            self._on_warning('zero quaternion', (
                'joint states with a quaternion that is all zero are ignored'))
            return False
        if not reading.followers.follow(values):
            self._on_warning('too large to mimic', (
                'positions that are too large for the joints that mimic them are ignored'))
            return False
        self.values = values
        self._given[reading.columns] = True
        return True

    def _report(self, stamp: int, reading: Reading) -> Rows:
        """Note the reported joints; return which joints are reported or silent."""
        rows = reading.rows
        gaps = stamp - self._reported[rows]
        self._gaps[rows] = np.where((gaps > 0) & (gaps <= _PATIENCE), gaps, 0)
        self._reported[rows] = stamp
        if reading.moves_all:
            return rows
        patience = np.minimum(_PERIODS * self._gaps, _PATIENCE)
        silent = (self._reported > _NEVER) & (self._reported < stamp - patience)
        return rows | silent

    def _is_due(self, stamp: int, rows: Rows, interval: int) -> bool:
        """Return whether one of some joints may be sent again, or a new run has begun."""
        earliest = int(self._sent[rows].min())
        return stamp >= earliest + interval or stamp < earliest - _ANOTHER_RUN

    def resume(self, before: 'JointStates', robot: Robot) -> None:
        """
        Take over the positions that were reported for another description.

        :param before: the joint states for that description.
        :param robot: of that description.
        """
        names = [name for name, given in zip(robot.motion.variables, before._given, strict=True)
                 if given and name in self._robot.columns]
        if names:
            newest = int(before._reported.max())
            self.update(newest, tuple(names), before.values[[robot.columns[n] for n in names]])

    def again(self) -> tuple[int, Rows] | None:
        """
        Return a stamp and the joints whose known positions to send again.

        The stamp is a nanosecond after the newest report, so that receivers take it as newer.
        """
        rows = self._reported > _NEVER
        if not rows.any():
            return None
        return int(self._reported.max()) + 1, rows

    def poses(self) -> Array:
        """Return ``parent_T_child`` (moving joints, 7) at the known positions."""
        return self._robot.motion.poses(self.values)


# --- recorded states

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
                 on_warning: Callable[[str], object] = warn) -> list[SampleTrack]:
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
    warned: set[str] = set()

    def warn_once(_: str, sentence: str) -> None:
        if sentence not in warned and len(warned) < _MAX_REMEMBERED:
            warned.add(sentence)
            on_warning(sentence)

    known = JointStates(robot, warn_once)
    stamps, values, sent = [], [], []
    for when, names, positions in states:
        stamp = checked_stamp(when)
        rows = known.update(stamp, tuple(names), np.asarray(positions, float))
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
