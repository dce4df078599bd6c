# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples of one edge since the last call."""

from collections import Counter
from dataclasses import dataclass, field
import math

from tf_tree_py.core.messages.incidents import count_refused, Kind

from .sample_rows import Rows


@dataclass
class Lately:
    """
    The samples of one edge since the last call.

    A delay is the time from the stamp to the arrival, nanoseconds. It is negative if the
    publisher's clock is ahead.

    :ivar count: the number of moving transforms, including refused ones.
    :ivar timed: how many of them have a delay: all that arrived after the clock began.
    :ivar incidents: how often each kind of incident happened.
    """

    count: int = 0
    timed: int = 0
    mean_delay: float = 0.0
    longest_delay: float = -math.inf
    shortest_delay: float = math.inf
    incidents: Counter[Kind] = field(default_factory=Counter)

    @property
    def refused(self) -> int:
        """Return how many samples were refused."""
        return count_refused(self.incidents)

    @property
    def ahead(self) -> float:
        """Return how far a stamp was ahead of the clock at most, nanoseconds."""
        return max(0.0, -self.shortest_delay)

    def add(self, rows: Rows) -> None:
        """Take samples of moving transforms."""
        self.count += len(rows)
        known = rows.where(rows.received > 0)
        delays = known.received - known.stamps
        if len(delays):
            self.timed += len(delays)
            self.mean_delay += (float(delays.mean()) - self.mean_delay) * len(delays) / self.timed
            self.longest_delay = max(self.longest_delay, float(delays.max()))
            self.shortest_delay = min(self.shortest_delay, float(delays.min()))
