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

"""What the stamps and the arrivals of one edge tell."""

import numpy as np

from .spread import Spread
from .stretch import Rows, Steps
from ..stamp import from_seconds

JUMP = from_seconds(1.0)
"""A stamp that goes back by more than this jumps to another time; by less, it is out of order."""


class Timing:
    """
    Counts and spreads of one edge's stamps; all times are nanoseconds.

    :ivar count: samples.
    :ivar first: when the first one arrived, by a clock that had begun; 0: none has.
    :ivar last: when the last one did.
    :ivar zeros: samples whose stamp is zero; nothing else is asked of them.
    :ivar delays: from the stamp to the arrival.
    :ivar intervals: from one stamp to the next.
    :ivar longest: the stamp at which the longest interval begins.
    :ivar duplicates: steps to the same stamp; ``differing`` of them to another pose.
    :ivar disorders: steps to an older stamp that the following stamps do not go on from.
    :ivar jumps: steps back from which they go on; ``back`` is the longest of these.
    """

    def __init__(self) -> None:
        self.count = self.zeros = 0
        self.first = self.last = self.longest = 0
        self.delays, self.intervals = Spread(), Spread()
        self.duplicates = self.differing = self.disorders = self.jumps = self.back = 0

    @property
    def timed(self) -> int:
        """Return how many samples have a stamp."""
        return self.count - self.zeros

    @property
    def span(self) -> int:
        """Return from the first arrival to the last."""
        return self.last - self.first

    @property
    def interval(self) -> float:
        """Return the usual time from one stamp to the next; 0 where there are not three."""
        return self.intervals.median

    @property
    def rate_hz(self) -> float:
        """Return how many samples a second arrived; 0 where there are not two."""
        return (self.count - 1) * 1e9 / self.span if self.span > 0 else 0.0

    def add(self, rows: Rows) -> None:
        """Take samples: note what each tells without its neighbours."""
        self.count += len(rows)
        timed = rows.stamps != 0
        self.zeros += len(rows) - int(np.count_nonzero(timed))
        known = rows.received > 0
        if known.any():
            received = rows.received[known]
            self.first = self.first or int(received[0])
            self.last = int(received[-1])
        heard = timed & known
        self.delays.add(rows.received[heard] - rows.stamps[heard])

    def add_steps(self, steps: Steps) -> None:
        """Take steps; the first and the last serve to judge their neighbours only."""
        before, time, after = steps.time[:-2], steps.time[1:-1], steps.time[2:]
        back = time <= -JUMP
        # After a late stamp the next one goes on again; one that is ahead went on before it.
        late, ahead = back & (after >= -time // 2), back & (before >= -time // 2)
        onward = (time > 0) & (after > np.minimum(-JUMP, -time // 2))
        self._add_intervals(steps.stamps[1:-2][onward], time[onward])
        same = time == 0
        self.duplicates += int(np.count_nonzero(same))
        self.differing += int(np.count_nonzero(same & (steps.size[1:-1] > 0.0)))
        self.disorders += int(np.count_nonzero((time < 0) & ~back | late))
        jumps = back & ~late & ~ahead
        if jumps.any():
            self.jumps += int(np.count_nonzero(jumps))
            self.back = max(self.back, -int(time[jumps].min()))

    def _add_intervals(self, stamps: np.ndarray, intervals: np.ndarray) -> None:
        if len(intervals) and intervals.max() > self.intervals.most:
            self.longest = int(stamps[intervals.argmax()])
        self.intervals.add(intervals)
