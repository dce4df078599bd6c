# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finds repeated stamps of an edge, stamps out of order, and jumps back."""

import numpy as np
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.core.times import Stamps

from .anomalies import Anomalies

# A larger step back means another run, or another clock: no message is delayed that long.
_JUMP = from_seconds(1.0)


class StampOrder:
    """Compares the stamp of each sample with that of the previous sample of its edge."""

    def __init__(self, oddities: Anomalies) -> None:
        """
        Begin before the first sample.

        :param oddities: receives the anomalies.
        """
        self._oddities = oddities
        self._last: dict[tuple[str, str], int] = {}

    def note(self, edge: tuple[str, str], stamp: int) -> None:
        """Check the next sample of an edge."""
        before = self._last.get(edge)
        self._last[edge] = stamp
        if before is not None and stamp <= before:
            self._oddities.note(*_fault(before, stamp), edge, first=stamp)

    def note_many(self, edge: tuple[str, str], stamps: Stamps) -> None:
        """Check the next samples of an edge, in order of arrival."""
        self.note(edge, int(stamps[0]))
        self._last[edge] = int(stamps[-1])
        for number in np.flatnonzero(stamps[1:] <= stamps[:-1]).tolist():
            before, stamp = int(stamps[number]), int(stamps[number + 1])
            self._oddities.note(*_fault(before, stamp), edge, first=stamp)


def _fault(before: int, stamp: int) -> tuple[str, str]:
    """Return the reason and a detail for a stamp that is not newer than the one before."""
    if stamp == before:
        return 'repeated stamp', (f'{format_stamp(stamp)} twice in a row; lookups use the last '
                                  'sample')
    reason = 'jump back' if before - stamp > _JUMP else 'out of order'
    return reason, (f'{format_stamp(stamp)} arrived after {format_stamp(before)}, '
                    f'which is {format_span(before - stamp)} newer')
