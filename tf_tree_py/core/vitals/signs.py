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

"""What is measured of one edge, in a few numbers."""

from dataclasses import asdict, dataclass
from typing import Any

from .edge import EdgeRecord


@dataclass(frozen=True)
class Signs:
    """
    The measurements of an edge from its first arrival to now; all times are nanoseconds.

    :ivar static: whether it came on topics of what does not move, and on no others.
    :ivar count: samples, with those that were refused.
    :ivar rate_hz: how many a second arrived; 0 where there are not two, and for static ones.
    :ivar delay_p50: from the stamp to the arrival, the usual one; None: not known.
    :ivar delay_p95: 95 of 100 delays are less.
    :ivar longest_gap: from one stamp to the next, at most; None where there are not enough.
    :ivar silence: since the last arrival; None for a static edge.
    :ivar publishers: who may have sent it.
    :ivar refused: how many the buffer did not take.
    """

    parent: str
    child: str
    static: bool
    count: int
    rate_hz: float
    delay_p50: int | None
    delay_p95: int | None
    longest_gap: int | None
    silence: int | None
    publishers: tuple[str, ...]
    refused: int

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {**asdict(self), 'publishers': list(self.publishers)}


def signs_of(edge: EdgeRecord, refused: int, now: int) -> Signs:
    """
    Return what is known of an edge.

    :param refused: how many the buffer did not take.
    :param now: when something arrived last, nanoseconds.
    """
    fixed = edge.fixed.count if edge.fixed else 0
    names = tuple(edge.authorities)
    if edge.moving is None:
        return Signs(edge.parent, edge.child, True, fixed, 0.0, None, None, None, None, names,
                     refused)
    timing = edge.moving.timing
    usual, late = timing.delays.at(0.5, 0.95)
    timed, several = timing.delays.count > 0, timing.intervals.count > 0
    return Signs(
        edge.parent, edge.child, False, timing.count + fixed, timing.rate_hz,
        round(usual) if timed else None, round(late) if timed else None,
        round(timing.intervals.most) if several else None,
        max(0, now - timing.last) if timing.last else None, names, refused)
