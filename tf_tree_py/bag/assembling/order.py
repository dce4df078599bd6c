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

"""Whether the stamps of each edge go on: what is repeated, out of order, or jumps back."""

import numpy as np
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.core.times import Stamps

from .oddities import Oddities

# Stamps that go back further are another run, or another clock: no message is so late.
_JUMP = from_seconds(1.0)


class Order:
    """Compares the stamp of each sample with that of the one of its edge that arrived before."""

    def __init__(self, oddities: Oddities) -> None:
        """
        Begin before the first sample.

        :param oddities: where to note what does not go on.
        """
        self._oddities = oddities
        self._last: dict[tuple[str, str], int] = {}

    def note(self, edge: tuple[str, str], stamp: int) -> None:
        """Look at the next sample of an edge."""
        before = self._last.get(edge)
        self._last[edge] = stamp
        if before is not None and stamp <= before:
            self._oddities.note(*_fault(before, stamp), edge, first=stamp)

    def note_many(self, edge: tuple[str, str], stamps: Stamps) -> None:
        """Look at the next samples of an edge, in order of arrival."""
        self.note(edge, int(stamps[0]))
        self._last[edge] = int(stamps[-1])
        for number in np.flatnonzero(stamps[1:] <= stamps[:-1]).tolist():
            before, stamp = int(stamps[number]), int(stamps[number + 1])
            self._oddities.note(*_fault(before, stamp), edge, first=stamp)


def _fault(before: int, stamp: int) -> tuple[str, str]:
    """Return what is wrong with a stamp that is not newer than the one before, and a detail."""
    if stamp == before:
        return 'repeated stamp', f'{format_stamp(stamp)} twice in a row; the last sample answers'
    reason = 'jump back' if before - stamp > _JUMP else 'out of order'
    return reason, (f'{format_stamp(stamp)} came behind {format_stamp(before)}, '
                    f'{format_span(before - stamp)} newer')
