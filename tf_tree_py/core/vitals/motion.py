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

"""What the poses of one edge tell."""

from dataclasses import dataclass
import math

import numpy as np

from .limits import Limits
from .spread import Spread
from .stretch import Mask, Rows, Steps
from ..geometry.so3 import Array
from ..stamp import from_seconds

# tf2's tolerance of a quaternion's length is 0.01; a float32 has 1e-7.
_LENGTH_TOLERANCE = 1e-3
# A smaller step is noise.
_NOISE = 1e-3
# A step that is this many times as fast as both its neighbours is a jump.
_ISOLATED = 10.0
# Two publishers of one edge that differ by less than this do little harm.
_DISPUTE = 5e-3
# A slow jump has at least this size, metres and radians together, and takes at least this long, so
# that many lookups fall into it.
_LARGE = 0.2
_LONG = from_seconds(0.09)


@dataclass
class Jump:
    """
    The largest of some steps.

    :ivar count: how many there were.
    :ivar stamp: before the largest, nanoseconds.
    :ivar time: from that stamp to the next, nanoseconds.
    :ivar gone: how far it went, metres.
    :ivar turned: how far it turned, radians.
    """

    count: int = 0
    stamp: int = 0
    time: int = 0
    gone: float = 0.0
    turned: float = 0.0

    def add(self, steps: Steps, which: Mask) -> None:
        """Take the steps, but the first and the last, that are marked."""
        found = np.flatnonzero(which) + 1
        if not len(found):
            return
        self.count += len(found)
        worst = found[steps.size[found].argmax()]
        if steps.size[worst] > self.gone + self.turned:
            self.stamp, self.time = int(steps.stamps[worst]), int(steps.time[worst])
            self.gone, self.turned = float(steps.gone[worst]), float(steps.turned[worst])


class Motion:
    """
    How one edge moves.

    :ivar moved: whether any pose differs from the first.
    :ivar planar: whether roll and pitch were exactly zero, always.
    :ivar tilt: the largest angle between its z axis and its parent's, radians.
    :ivar off_length: how many quaternions are not of unit length; ``worst_length`` is the
        length that is furthest from it.
    :ivar sizes: of its steps: metres and radians together.
    :ivar fast: steps faster than the limits and than those around them.
    :ivar slow: large steps that are faster than those around them only, and take long.
    :ivar turns: steps that the next one takes back; ``size_of_turns``, of them.
    :ivar large: steps at least half as large as those.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._first: Array | None = None
        self.moved, self.planar, self.tilt = False, True, 0.0
        self.off_length, self.worst_length = 0, 1.0
        self.sizes = Spread()
        self.fast, self.slow = Jump(), Jump()
        self.turns = self.large = 0
        self.size_of_turns = Spread()

    def add(self, rows: Rows) -> None:
        """Take samples: note what each tells without its neighbours."""
        poses = rows.poses
        if self._first is None:
            self._first = poses[0].copy()
        self.moved = self.moved or bool((poses != self._first).any())
        q = poses[:, 3:]
        lengths = np.sqrt(np.einsum('ij,ij->i', q, q))
        off = np.abs(lengths - 1.0)
        worst = off.argmax()
        if off[worst] > _LENGTH_TOLERANCE:
            self.off_length += int(np.count_nonzero(off > _LENGTH_TOLERANCE))
            self.worst_length = max(self.worst_length, float(lengths[worst]),
                                    key=lambda length: abs(length - 1.0))
        tilts = np.hypot(q[:, 0], q[:, 1])
        self.planar = self.planar and not tilts.any()
        self.tilt = max(self.tilt, 2.0 * math.asin(min(1.0, float((tilts / lengths).max()))))

    def add_steps(self, steps: Steps) -> None:
        """Take steps; the first and the last serve to judge their neighbours only."""
        size, time = steps.size[1:-1], steps.time[1:-1]
        self.sizes.add(size)
        if not self.moved:
            return
        speed = steps.size * 1e9 / np.maximum(steps.time, 1)
        alone = (time > 0) & (speed[1:-1] > _ISOLATED * np.maximum(speed[:-2], speed[2:]))
        if alone.any():
            seconds = time / 1e9
            fast = ((steps.gone[1:-1] > self._limits.max_speed * seconds)
                    | (steps.turned[1:-1] > self._limits.max_turn_rate * seconds))
            self.fast.add(steps, alone & fast & (size > _NOISE))
            self.slow.add(steps, alone & ~fast & (size > _LARGE) & (time > _LONG))
        self._add_turns(steps)

    def _add_turns(self, steps: Steps) -> None:
        size, after = steps.size[1:-1], steps.size[2:]
        smaller = np.minimum(size, after)
        # Samples that arrive late go back, too.
        in_order = (steps.time[1:-1] >= 0) & (steps.time[2:] >= 0)
        turns = in_order & (smaller > _DISPUTE) & (steps.size_of_two[1:] < 0.3 * smaller)
        if turns.any():
            self.turns += int(np.count_nonzero(turns))
            self.size_of_turns.add(smaller[turns])
        if self.turns:
            self.large += int(np.count_nonzero(size > 0.5 * self.size_of_turns.median))
