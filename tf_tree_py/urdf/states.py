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

"""The joint states of a robot as they come in: what is known, and which edges to send."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.suggest import known_names

from .elements import listed, quoted
from .following import followers
from .joints import FIXED
from .robot import Robot

Rows = npt.NDArray[np.bool_]

# A joint is reported regularly where that happens within _PATIENCE; then it is silent after so
# many of its periods, and after _PATIENCE at the latest.
_PERIODS = 3
_PATIENCE = NANOSECONDS_PER_SECOND
# A stamp that lies further back than this is of another run.
_ANOTHER_RUN = NANOSECONDS_PER_SECOND
# Different lists of names, and things that were told, that are remembered.
_MAX_REMEMBERED = 256
# Earlier than every stamp that a message can hold, and no difference to one overflows.
_NEVER = -2**62


class Reading:
    """
    What a list of names in a message means for a robot.

    :ivar picks: which of the positions are read.
    :ivar columns: the variables that they are.
    :ivar rows: which of the moving joints they move, those that mimic them too.
    """

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        """Look the names up; the first of two equal ones counts."""
        places = {name: place for place, name in reversed(list(enumerate(names)))}
        known = {name: place for name, place in places.items() if name in robot.columns}
        # Some publishers name what is fixed, too: that is no mistake.
        fixed = {joint.name for joint in robot.joints if joint.kind == FIXED}
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
    The last position of every joint, and which edges are to be sent.

    A message moves the joints that it names, and those that mimic them. A joint that it does
    not name keeps its last position, and is sent with that when nobody reports it any more:
    while a publisher of its own reports it regularly, a position of before would be wrong.

    :ivar values: (variables,) of all moving joints.
    """

    def __init__(self, robot: Robot, tell: Callable[[str], object]) -> None:
        """
        Begin at rest, with nothing reported.

        :param tell: hears in a sentence what of the messages cannot be used, each once.
        """
        self._robot, self._tell_somebody = robot, tell
        self._told: set[str] = set()
        self._readings: dict[tuple[str, ...], Reading] = {}
        self.values = robot.rest.copy()
        self._given = np.zeros(len(self.values), bool)
        # By joint: when it was reported last, how long after the time before, and sent last.
        joints = len(robot.moving)
        self._reported = np.full(joints, _NEVER, np.int64)
        self._gaps = np.zeros(joints, np.int64)
        self._sent = np.full(joints, _NEVER, np.int64)

    def take(self, stamp: int, names: tuple[str, ...], positions: Array,
             interval: int | None = None) -> Rows | None:
        """
        Take a message, and return which of the moving joints are to be sent with its stamp.

        :param positions: one for each name.
        :param interval: how long after a joint was sent it may be sent again, nanoseconds;
            None: no matter when.
        :return: (moving joints,); None: there is nothing to send.
        """
        if positions.shape != (len(names),):
            self._tell(f'{len(names)} names and {positions.size} positions: such joint states '
                       'are ignored')
            return None
        reading = self._reading(names)
        given = positions[reading.picks]
        finite = np.isfinite(given)
        if not finite.all():
            bad = reading.picks[~finite]
            self._tell('positions that are not finite are ignored: of '
                       + listed(quoted(names[place]) for place in bad))
            good = np.setdiff1d(np.arange(len(names)), bad)
            return self.take(stamp, tuple(names[place] for place in good), positions[good],
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
            unknown = [name for name in reading.unknown if name not in self._told]
            if unknown and len(self._told) < _MAX_REMEMBERED:
                self._told.update(unknown)
                self._tell('joint states came of what is no joint of this robot: '
                           f'{listed(map(quoted, unknown))}. '
                           + known_names(unknown[0], tuple(self._robot.columns)))
        return reading

    def _set(self, reading: Reading, given: Array) -> bool:
        """Set what is given, and who follows; return False for what is no rotation."""
        values = self.values.copy()
        values[reading.columns] = given
        if not self._robot.motion.has_turns(values):
            self._tell('joint states with a quaternion that is all zero are ignored')
            return False
        reading.followers.follow(values)
        self.values = values
        self._given[reading.columns] = True
        return True

    def _report(self, stamp: int, reading: Reading) -> Rows:
        """Note which joints are reported; return them, and those that are not any more."""
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
        """Return whether the one that was sent longest ago may go again; or another run began."""
        earliest = int(self._sent[rows].min())
        return stamp >= earliest + interval or stamp < earliest - _ANOTHER_RUN

    def resume(self, before: 'JointStates', robot: Robot) -> None:
        """
        Take over the positions that were given before, where the description was another.

        :param robot: the one of before.
        """
        names = [name for name, given in zip(robot.motion.variables, before._given, strict=True)
                 if given and name in self._robot.columns]
        if names:
            newest = int(before._reported.max())
            self.take(newest, tuple(names), before.values[[robot.columns[n] for n in names]])

    def again(self) -> tuple[int, Rows] | None:
        """
        Return what is to be sent of what is known already, and with which stamp.

        A nanosecond after the newest report, so that whoever has that takes this as newer.
        """
        rows = self._reported > _NEVER
        if not rows.any():
            return None
        return int(self._reported.max()) + 1, rows

    def poses(self) -> Array:
        """Return ``parent_T_child`` (moving joints, 7) of what is known."""
        return self._robot.motion.poses(self.values)

    def _tell(self, sentence: str) -> None:
        if sentence not in self._told and len(self._told) < 2 * _MAX_REMEMBERED:
            self._told.add(sentence)
            self._tell_somebody(sentence)
