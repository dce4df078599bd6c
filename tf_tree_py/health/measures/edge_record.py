# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All measurements of one edge, and of the parents of one child; and a summary of them."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from tf_tree_py.core.messages.incidents import candidates, is_ambiguous
from tf_tree_py.core.stamp import is_silent, NANOSECONDS_PER_SECOND
from tf_tree_py.core.text import shorten

from .motion import Motion
from .sample_rows import distances, MessageColumn, NO_ROWS, Rows, Steps, TAIL, unit_poses
from .thresholds import Thresholds
from .timebase import Timebase
from .timing import far_steps, Timing

Edge = tuple[str, str]

# At most this many publishers of an edge are named.
_MAX_AUTHORITIES = 8
# At most this many edges beside an edge are kept, with names of at most this many characters.
_MAX_BESIDE, _MAX_LETTERS = 64, 200
# The number of characters of a name that a sentence shows.
_LONGEST = 80
# A static transform that differs by less than this, metres and radians together, is the same; or
# by this part of its distance, which is the precision of a float32.
_SAME, _FLOAT32 = 1e-6, 2.0**-23


class MovingEdge:
    """
    The samples of one edge on topics of moving transforms.

    :ivar timing: the measurements of its stamps and arrivals.
    :ivar motion: the measurements of its poses; invalid poses are omitted.
    :ivar beside: edges of the messages that contained it, including itself.
    :ivar lone: how many samples had a stamp far older than those received before and after; they
        are left out of the other measures, except that of the delays.
    :ivar first_lone: the first of them, and the next sample; None: there is none.
    """

    def __init__(self, limits: Thresholds) -> None:
        self.lone = 0
        self.first_lone: Rows | None = None
        self.timing = Timing()
        self.motion = Motion(limits)
        self.beside: set[Edge] = set()
        self._judged = False
        self._tail = NO_ROWS

    def add(self, rows: Rows, beside: Sequence[Edge]) -> None:
        """Add samples, in order of arrival."""
        if len(self.beside) < _MAX_BESIDE:
            self.beside.update(edge for edge in beside[:_MAX_BESIDE]
                               if len(edge[0]) + len(edge[1]) <= _MAX_LETTERS)
        self.timing.add(rows)
        useful = rows.of_use()
        if not len(useful):
            return
        self.motion.add(useful)
        stretch = useful.where(useful.stamps != 0).after(self._tail)
        stretch = self._without_repeats(stretch, max(len(self._tail), 1))
        if len(stretch) > TAIL:
            stretch = self._without_lone(stretch)
        # A step is judged by the steps before and after it, so the last rows are used again.
        self._tail = stretch.last(TAIL)
        if len(stretch) > TAIL:
            steps = Steps(stretch)
            self.timing.add_steps(steps)
            self.motion.add_steps(steps)

    def _without_lone(self, rows: Rows) -> Rows:
        """Count the lone samples that are too old; return the other rows."""
        found = far_steps(rows.received, rows.stamps)
        places = found.between if self._judged else np.concatenate(
            [found.ends[found.ends == 0], found.between])
        self._judged = True
        places = places[rows.stamps[places] < rows.stamps[places + 1]]
        if not len(places):
            return rows
        self.lone += len(places)
        if self.first_lone is None:
            self.first_lone = rows[places[0]:places[0] + 2]
        return rows[np.delete(np.arange(len(rows)), places)]

    def _without_repeats(self, rows: Rows, begin: int) -> Rows:
        """
        Count the repeated stamps; return the rows without those that repeat the pose, too.

        :param begin: the first row that is new, and not the first of all.
        """
        same = np.zeros(len(rows), bool)
        same[begin:] = np.diff(rows.stamps)[begin - 1:] == 0
        if not same.any():
            return rows
        repeats = same.copy()
        repeats[1:] &= (rows.poses[:, 1:] == rows.poses[:, :-1]).all(axis=0)
        self.timing.duplicates += int(np.count_nonzero(same))
        self.timing.differing += int(np.count_nonzero(same & ~repeats))
        return rows[~repeats]


class FixedEdge:
    """
    The samples of one edge on topics of static transforms.

    :ivar count: the number of samples.
    :ivar first: when the first one arrived after the clock had begun; 0: none has.
    :ivar last: when the last one arrived.
    :ivar changes: how often the pose changed; ``at_once`` of these within a second of the value
        before.
    :ivar gone: the largest translation of a change, metres.
    :ivar turned: the largest rotation of a change, radians.
    """

    def __init__(self) -> None:
        self.count = self.changes = self.at_once = self.first = self.last = 0
        self.gone = self.turned = 0.0
        # The last sample of use.
        self._tail = NO_ROWS

    def add(self, rows: Rows) -> None:
        """Add samples, in order of arrival."""
        self.count += len(rows)
        known = rows.received[rows.received > 0]
        if len(known):
            self.first = self.first or int(known[0])
            self.last = int(known[-1])
        useful = rows.of_use().after(self._tail)
        self._tail = useful.last(1)
        poses = unit_poses(useful.poses)
        gone, turned = distances(poses, 1)
        changed = gone + turned > _SAME + _FLOAT32 * np.abs(poses[:3, 1:]).sum(axis=0)
        if changed.any():
            self.changes += int(np.count_nonzero(changed))
            self.at_once += int(np.count_nonzero(
                changed & (useful.received[:-1] > 0)
                & (np.diff(useful.received) < NANOSECONDS_PER_SECOND)))
            self.gone = max(self.gone, float(gone[changed].max()))
            self.turned = max(self.turned, float(turned[changed].max()))


class EdgeRecord:
    """
    All measurements of one edge.

    :ivar moving: its samples on topics of moving transforms; None: it has none.
    :ivar fixed: its samples on topics of static transforms; likewise.
    :ivar authorities: its publishers.
    """

    def __init__(self, parent: str, child: str) -> None:
        self.parent = parent
        self.child = child
        self.moving: MovingEdge | None = None
        self.fixed: FixedEdge | None = None
        self.authorities: dict[str, None] = {}

    @property
    def frames(self) -> Edge:
        """Return its parent and its child."""
        return self.parent, self.child

    def __str__(self) -> str:
        return f'{shorten(self.parent, _LONGEST)} -> {shorten(self.child, _LONGEST)}'

    def add(self, column: MessageColumn, limits: Thresholds) -> None:
        """Add the samples of a column."""
        # Ambiguous authorities come last: a name that became ambiguous was assigned too early.
        for authority in sorted(column.authorities, key=lambda name: (is_ambiguous(name), name)):
            self._name(authority)
        # A pose may contain any finite number; sums of very large numbers are infinite or NaN.
        with np.errstate(all='ignore'):
            if column.static:
                self.fixed = self.fixed or FixedEdge()
                self.fixed.add(column.rows)
            else:
                self.moving = self.moving or MovingEdge(limits)
                self.moving.add(column.rows, column.beside)

    def _name(self, authority: str) -> None:
        """Add a publisher; it replaces earlier ambiguous or wrong names of it."""
        names = {*candidates(authority)}
        for other in [other for other in self.authorities
                      if is_ambiguous(other) is not is_ambiguous(authority)]:
            if names & {*candidates(other)}:
                del self.authorities[other]
        if len(self.authorities) < _MAX_AUTHORITIES:
            self.authorities.setdefault(authority)


class Parents:
    """
    The changes of a child's parent.

    :ivar switches: their number.
    :ivar first: when the first change arrived, nanoseconds.
    :ivar last: when the last change arrived, nanoseconds.
    """

    def __init__(self) -> None:
        self.switches = self.first = self.last = 0
        self._last_parent = ''

    def add(self, columns: Sequence[MessageColumn]) -> None:
        """Add the columns of one child that were gathered together."""
        parents = list(dict.fromkeys(column.edge[0] for column in columns))
        if parents == [self._last_parent]:
            return
        order = np.concatenate([column.order for column in columns])
        received = np.concatenate([column.rows.received for column in columns])
        which = np.repeat([parents.index(column.edge[0]) for column in columns],
                          [len(column.order) for column in columns])
        arrived = np.argsort(order, kind='stable')
        which, received = which[arrived], received[arrived]
        changes = np.flatnonzero(np.diff(which)) + 1
        if self._last_parent and parents[which[0]] != self._last_parent:
            changes = np.concatenate([[0], changes])
        self._last_parent = parents[which[-1]]
        if len(changes):
            self.switches += len(changes)
            self.first = self.first or int(received[changes[0]])
            self.last = int(received[changes[-1]])


# --- the summary

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

    def as_dict(self) -> dict[str, object]:
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
    """Return whether an edge is silent that was moving when it was received last."""
    return (edge.moving is not None
            and (edge.fixed is None or edge.fixed.last < edge.moving.timing.last)
            and is_silent(silence_of(edge, now, timebase), edge.moving.timing.interval))


def silence_of(edge: EdgeRecord, now: int, timebase: Timebase) -> float:
    """Return the time since the last arrival, nanoseconds by the clock of the stamps."""
    if edge.moving is None or not edge.moving.timing.last:
        return 0.0
    return max(0.0, timebase.elapsed(edge.moving.timing.last, now))
