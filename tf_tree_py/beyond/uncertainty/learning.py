# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What is learnt from the samples of an edge, cell by cell of time, and cached.

It depends only on the samples: not on the order of their arrival, nor on the times of the calls.
So a cell is a fixed interval of time, and counts from when the next samples cannot change it any
more until one of its samples expires, or another arrives late.
"""

from bisect import bisect_left
from collections.abc import Callable
from typing import Any, cast, NamedTuple, Protocol, TypeVar

import numpy as np
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import ExtrapolationException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import BEGINNING, FOREVER, from_seconds, mean_interval
from tf_tree_py.core.times import Indices, Stamps
from tf_tree_py.core.tree.companions import Companion

LATELY = from_seconds(10.0)
"""Older samples do not count."""

# There are at most this many cells, and that many samples are used of one.
_MOST_CELLS, _MOST_SAMPLES = 32, 16
# Curves have no samples, but have a pose at every stamp: so many of them are used of a cell.
_STARTS_ON_CURVE = 8
# The fourth power of larger errors does not fit into floats.
_LARGEST = 1e75


class Learner(Protocol):
    """What is learnt of one edge."""

    def __init__(self, history: MovingHistory) -> None:
        """Begin with nothing."""

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all that a sample may have changed, which was inserted before the newest one."""


_L = TypeVar('_L', bound=Learner)


class Learnt(Companion):
    """
    What was learnt of the edges of a tree.

    :ivar by_child: the learners of each edge, by its child frame and their class.
    """

    def __init__(self) -> None:
        self.by_child: dict[str, dict[type[Any], Learner]] = {}

    def structure_changed(self) -> None:
        """
        Remove all: only samples with the newest parent count.

        A late sample of an edge that has had other parents changes the structure, too.
        """
        self.by_child.clear()

    def of(self, history: MovingHistory, kind: type[_L]) -> _L:
        """Return a learner of an edge; that of a curve, which may be replaced, is new."""
        if not history.takes_samples:
            return kind(history)
        known = self.by_child.setdefault(history.child, {})
        if history.late != FOREVER:
            for each in known.values():
                each.forget(history, history.late)
            history.late = FOREVER
        learner = known.get(kind)
        if learner is None:
            learner = known[kind] = kind(history)
        return cast(_L, learner)


def parent_since(history: MovingHistory) -> int:
    """Return the stamp since which an edge has its parent; ``BEGINNING`` if always."""
    if history.newest_stamp is None or history.fixed_parent or not history.takes_samples:
        return BEGINNING
    *_, (_, begin, _) = history.parents_between(BEGINNING, history.newest_stamp + 1)
    return begin


def check_size(history: MovingHistory, largest: float) -> None:
    """
    Raise an exception if errors are too large to be computed with.

    :param largest: metres.
    """
    if not largest < _LARGEST:
        raise ExtrapolationException(
            f'Poses of the edge {history.parent} -> {history.child} are {largest:g} m away from '
            'what its other samples lead to expect, too far for a covariance: find out which '
            'samples of the edge are that far apart')


# --- cells

class Span(NamedTuple):
    """
    The time of which something is learnt.

    :ivar oldest: the first stamp with a pose that counts.
    :ivar newest: the last that no next sample changes: the sample before the newest one, because
        another one with its stamp would replace that.
    :ivar cell: the length of a cell.
    :ivar period: the mean time between samples; 0 for a curve.
    """

    oldest: int
    newest: int
    cell: int
    period: float


def span_of(history: MovingHistory, newest: int, since: int) -> Span:
    """
    Return the time that counts.

    The cells are halved while the history is short.

    :param newest: the newest sample; ``since``: older samples do not count.
    """
    assert history.oldest_stamp is not None
    oldest = max(history.oldest_stamp, newest - LATELY)
    # How often the span of the samples fits into the whole time, as a power of two.
    halved = (LATELY // max(newest - oldest, 1)).bit_length() - 1
    before, period, begin = newest, 0.0, max(oldest, since)
    if history.takes_samples:
        stamps = history.columns().stamps
        place = bisect_left(stamps, newest)
        before = stamps[max(place - 1, 0)]
        period = mean_interval(newest - begin, place + 1 - bisect_left(stamps, begin))
    return Span(begin, before, max(LATELY // _MOST_CELLS >> max(halved, 0), 1), period)


class Sums(NamedTuple):
    """
    The sums of n cells.

    :ivar rows: (n, width), the first column how many terms the others have.
    :ivar ends: (n,) no sample after it, and none with this stamp, changes the row.
    """

    rows: Array
    ends: Stamps


class Cells:
    """The sums of successive cells, of one length."""

    __slots__ = ('_cell', '_first', '_sums')

    def __init__(self) -> None:
        self._cell = 0
        self._first = 0
        self._sums: Sums | None = None

    def rows(self, cell: int, first: int, last: int,
             learn: Callable[[int, int], Sums]) -> Array:
        """
        Return the rows of cells that have terms.

        :param cell: the length of one.
        :param first: the first cell; ``last``: likewise, and all before it are complete.
        :param learn: returns the sums from one cell to another.
        """
        if last < first:
            return np.empty((0, 1))
        if cell != self._cell:
            self._cell, self._sums = cell, None
        known = self._sums
        if known is not None:
            gone = first - self._first
            known = Sums(known.rows[gone:], known.ends[gone:]) if gone >= 0 else None
        if known is None or not len(known.rows):
            known = learn(first, last)
        elif first + len(known.rows) <= last:
            new = learn(first + len(known.rows), last)
            known = Sums(*(np.concatenate(parts) for parts in zip(known, new, strict=True)))
        self._first, self._sums = first, known
        rows = known.rows[:last - first + 1]
        return np.asarray(rows[rows[:, 0] > 0.0])

    def forget(self, late: int) -> None:
        """Forget the cells that a late sample may have changed, and all after them."""
        if self._sums is not None:
            changed = self._sums.ends >= late
            kept = int(changed.argmax()) if changed.any() else len(changed)
            self._sums = Sums(self._sums.rows[:kept], self._sums.ends[:kept])


def sums_by_cell(cell: int, first: int, last: int, stamps: Stamps, terms: Array,
                 ends: Stamps) -> Sums:
    """
    Return the sums of terms.

    :param stamps: (N,) sorted, that decide about the cell; ``terms``: (N, width - 1).
    :param ends: (N,) see ``Sums``.
    """
    count = last - first + 1
    rows, until = np.zeros((count, 1 + terms.shape[1])), cell * np.arange(first + 1, last + 2)
    cells = stamps // cell - first
    begins = changes(cells)
    if len(begins):
        known = cells[begins]
        rows[known, 0] = np.diff(np.append(begins, len(cells)))
        rows[known, 1:] = np.add.reduceat(terms, begins, axis=0)
        until[known] = np.maximum(until[known], np.maximum.reduceat(ends, begins))
    return Sums(rows, until)


def stamps_in(history: MovingHistory, begin: int, end: int) -> Stamps:
    """Return the different stamps of the samples from one time until before another, (N,)."""
    stamps = history.columns().stamps
    first, last = (bisect_left(stamps, stamp) for stamp in (begin, end))
    found: Stamps = np.array(stamps[first:last], dtype=np.int64)
    return found[changes(found)]


def chosen(history: MovingHistory, cell: int, first: int, last: int, most: int = _MOST_SAMPLES,
           ) -> Stamps:
    """Return stamps of samples, evenly distributed over cells, with at most so many in each."""
    begin, end = first * cell, (last + 1) * cell
    if not history.takes_samples:
        return np.arange(begin, end, max(cell // _STARTS_ON_CURVE, 1), dtype=np.int64)
    stamps = stamps_in(history, begin, end)
    begins = changes(stamps // cell)
    sizes = np.diff(np.append(begins, len(stamps)))
    ranks = np.arange(len(stamps)) - np.repeat(begins, sizes)
    steps = np.repeat(-(-sizes // most), sizes)
    return np.asarray(stamps[ranks % steps == 0])


def changes(values: Stamps) -> Indices:
    """Return the indices of the first value, and of those that differ from the one before."""
    return np.flatnonzero(np.append(True, values[1:] != values[:-1])[:len(values)])
