# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A summary of the measurements of one edge."""

from dataclasses import asdict, dataclass
from typing import Any

from tf_tree_py.core.stamp import is_silent

from .edge_record import EdgeRecord
from .timebase import Timebase


@dataclass(frozen=True)
class Symptoms:
    """
    The measurements of an edge from its first arrival to now; all times are nanoseconds.

    :ivar static: whether it arrived only on topics of static transforms.
    :ivar count: the number of samples, including refused ones.
    :ivar rate_hz: samples per second; 0 with fewer than two samples, and for static edges.
    :ivar delay_p50: the median delay from the stamp to the arrival; None: not known.
    :ivar delay_p95: 95 % of the delays are shorter.
    :ivar longest_gap: the longest interval between stamps; None with too few samples.
    :ivar silence: the time since the last arrival; None for a static edge.
    :ivar stale: whether its next sample is overdue.
    :ivar publishers: the possible publishers.
    :ivar refused: how many samples the buffer refused.
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
    stale: bool
    publishers: tuple[str, ...]
    refused: int

    def as_dict(self) -> dict[str, Any]:
        """Return the measurements as plain data."""
        return {**asdict(self), 'publishers': list(self.publishers)}


def symptoms_of(edge: EdgeRecord, refused: int, now: int, timebase: Timebase) -> Symptoms:
    """
    Return the measurements of an edge.

    :param refused: how many samples the buffer refused.
    :param now: the time by the clock of the arrivals, nanoseconds.
    :param timebase: of the stamps of all edges.
    """
    fixed = edge.fixed.count if edge.fixed else 0
    names = tuple(edge.authorities)
    if edge.moving is None:
        return Symptoms(edge.parent, edge.child, True, fixed, 0.0, None, None, None, None, False,
                        names, refused)
    timing = edge.moving.timing
    usual, late = timing.delays.at(0.5, 0.95)
    timed, several = timing.delays.count > 0, timing.intervals.count > 0
    return Symptoms(
        edge.parent, edge.child, False, timing.count + fixed, timing.rate_hz,
        round(usual) if timed else None, round(late) if timed else None,
        round(timing.intervals.most) if several else None,
        max(0, now - timing.last) if timing.last else None,
        is_stale(edge, now, timebase),
        names, refused)


def is_stale(edge: EdgeRecord, now: int, timebase: Timebase) -> bool:
    """Return whether a moving edge is silent, unless it was sent as static, too."""
    return (edge.moving is not None and edge.fixed is None
            and is_silent(silence_of(edge, now, timebase), edge.moving.timing.interval))


def silence_of(edge: EdgeRecord, now: int, timebase: Timebase) -> float:
    """Return the time since the last arrival, nanoseconds by the clock of the stamps."""
    if edge.moving is None or not edge.moving.timing.last:
        return 0.0
    return max(0.0, timebase.elapsed(edge.moving.timing.last, now))
