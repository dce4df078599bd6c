# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The samples of one edge as arrays, the steps between them, and those since the last call.

Received messages are gathered until there are enough to process together.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import no_truth
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.poses import judged
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import count_refused, Kind
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.times import Stamps

Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

TAIL = 4
"""The number of rows that are used again with the next: a step is judged by its neighbours."""

JUDGED = slice(1, -2)
"""The steps of a stretch that are judged: those with one step before and two after them."""


@dataclass(frozen=True)
class Rows:
    """
    Samples of one edge, in order of arrival.

    :ivar received: (N,) nanoseconds; 0 if the clock had not begun.
    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (7, N) as received, unchecked: each coordinate is contiguous, because numpy takes
        several times as long for numbers that are apart.
    """

    received: Stamps
    stamps: Stamps
    poses: Array

    def __getitem__(self, part: slice | Mask | Places) -> 'Rows':
        return Rows(self.received[part], self.stamps[part], self.poses[:, part])

    def __len__(self) -> int:
        return len(self.stamps)

    __bool__ = no_truth

    def after(self, tail: 'Rows') -> 'Rows':
        """Return the last rows of the previous stretch, followed by these rows."""
        return Rows(np.concatenate([tail.received, self.received]),
                    np.concatenate([tail.stamps, self.stamps]),
                    np.concatenate([tail.poses, self.poses], axis=1))

    def last(self, count: int) -> 'Rows':
        """Return a copy of the last rows, which does not keep the others in memory."""
        return Rows(self.received[-count:].copy(), self.stamps[-count:].copy(),
                    self.poses[:, -count:].copy())

    def where(self, mask: Mask) -> 'Rows':
        """Return the marked rows; without a copy if all are, as is usual."""
        return self if mask.all() else self[mask]

    def of_use(self) -> 'Rows':
        """Return the rows with a valid pose: finite, with a quaternion that is not zero."""
        finite = np.isfinite(self.poses)
        if finite.all() and self.poses[6].all():
            # The common case: no w is zero, so no quaternion is.
            return self
        return self.where(finite.all(axis=0) & self.poses[3:].any(axis=0))


NO_ROWS = Rows(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((7, 0)))


class Steps:
    """
    The steps between N successive rows, (N - 1,), and over two rows, (N - 2,).

    In a ``size``, one metre of translation counts as much as one radian of rotation: both move
    a point that is a metre away from the frame by a metre.

    :ivar stamps: of the row before each step, nanoseconds.
    :ivar received: when the row before each step arrived, nanoseconds; 0: not known.
    :ivar waited: the time between successive arrivals, nanoseconds.
    :ivar time: the time between successive stamps, nanoseconds.
    :ivar gone: the translation, metres.
    :ivar turned: the rotation, radians.
    :ivar size: the sum of both.
    """

    def __init__(self, rows: Rows) -> None:
        self.stamps = rows.stamps[:-1]
        self.received = rows.received[:-1]
        self.waited = rows.received[1:] - self.received
        self.time = rows.stamps[1:] - self.stamps
        self._poses = unit_poses(rows.poses)
        self.gone, self.turned = distances(self._poses, 1)
        self.size = self.gone + self.turned

    @cached_property
    def points(self) -> Array:
        """Return (7, N) positions, metres, and rotations as radians, near each other."""
        points = self._poses.copy()
        q = points[3:]
        q *= 2.0 * np.cumprod(np.concatenate([[1.0], np.where(
            np.einsum('ij,ij->j', q[:, 1:], q[:, :-1]) < 0.0, -1.0, 1.0)]))
        return points

    @cached_property
    def aside(self) -> Array:
        """
        Return how far each row is from where one publisher may have it, (7, N - 2).

        The first three rows are metres, the others radians. A publisher may stamp its samples
        late. So on the line between its two neighbours, a sample is at the point that its stamp
        implies, or in the middle, if the samples are taken regularly.
        """
        poses = self.points
        line = poses[:, 2:] - poses[:, :-2]
        aside: Array = poses[:, 1:-1] - poses[:, :-2]
        length = np.einsum('ij,ij->j', line, line)
        part = np.einsum('ij,ij->j', aside, line) / np.where(length > 0.0, length, 1.0)
        before, after = self.time[:-1].astype(float), self.time[1:].astype(float)
        implied = np.where((before >= 0.0) & (after >= 0.0) & (before + after > 0.0),
                           before / np.maximum(before + after, 1.0), 0.5)
        aside -= np.where(np.abs(part - implied) < np.abs(part - 0.5), implied, 0.5) * line
        return aside

    @property
    def sizes(self) -> tuple[Array, Array]:
        """Return the translations, metres, and the rotations, radians."""
        return self.gone, self.turned

    @cached_property
    def sizes_of_two(self) -> tuple[Array, Array]:
        """Return the same of the steps over two rows, which few edges need."""
        return distances(self._poses, 2)


def unit_poses(poses: Array) -> Array:
    """Return poses (7, N) of use with unit quaternions."""
    return judged(poses.T)[0].T


def distances(poses: Array, over: int) -> tuple[Array, Array]:
    """Return the distances of poses (7, N) over so many rows: metres, radians, (N - over,)."""
    return se3.distance_many(poses[:, :-over].T, poses[:, over:].T)


@dataclass
class RecentSamples:
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
        """Add samples of moving transforms."""
        self.count += len(rows)
        known = rows.where(rows.received > 0)
        delays = known.received - known.stamps
        if len(delays):
            self.timed += len(delays)
            self.mean_delay += (float(delays.mean()) - self.mean_delay) * len(delays) / self.timed
            self.longest_delay = max(self.longest_delay, float(delays.max()))
            self.shortest_delay = min(self.shortest_delay, float(delays.min()))


# --- gathering messages

Edge = tuple[str, str]

# How many transforms to gather, how many of each edge, and how many at most: enough to make
# numpy's cost per transform small, and few enough to take only some megabytes.
ENOUGH, OF_EACH, _MOST = 30_000, 100, 100_000
# This many characters of names take about as much memory as a transform.
_LETTERS = 10
# Messages that are not like any other take as much memory as this many more transforms.
_OF_A_KIND = 6


class MessageColumn(NamedTuple):
    """
    The samples of one edge on topics of one kind.

    :ivar rows: in order of arrival.
    :ivar order: (N,) the number of each row's message.
    :ivar beside: the edges of the messages that contained it, including itself.
    :ivar authorities: its publishers.
    """

    edge: Edge
    static: bool
    rows: Rows
    order: npt.NDArray[np.int64]
    beside: Sequence[Edge]
    authorities: frozenset[str]


class _AlikeMessages:
    """
    Messages with the same edges on the same topic.

    The objects of each message are not kept. So many of them would not fit into the processor's
    cache, and numbers that are read and freed there take several times as long.

    :ivar edges: referenced, so that no other object gets its id.
    """

    __slots__ = ('edges', 'static', '_order', '_received', '_stamps', '_poses', '_authorities')

    def __init__(self, arrival: ReceivedMessage) -> None:
        self.edges = arrival.batch.edges
        self.static = arrival.static
        self._order: list[int] = []
        self._received: list[int] = []
        self._stamps: list[Sequence[int]] = []
        self._poses: list[bytes] = []
        self._authorities: set[str] = set()

    def add(self, arrival: ReceivedMessage, number: int) -> None:
        """Add a message."""
        batch, received, _, _, authority = arrival
        self._order.append(number)
        self._received.append(received)
        self._stamps.append(batch.stamps)
        self._poses.append(b''.join(batch.poses))
        self._authorities.add(authority)

    def columns(self) -> Iterator[MessageColumn]:
        """Yield a column for each edge."""
        count = len(self._order)
        order, received = np.array(self._order, np.int64), np.array(self._received, np.int64)
        authorities = frozenset(self._authorities) - {''}
        # The numbers of an edge, and each of its coordinates, become contiguous.
        stamps = np.array(self._stamps, np.int64).T.copy()
        poses = np.frombuffer(b''.join(self._poses)).reshape(
            count, len(self.edges), 7).transpose(1, 2, 0).copy()
        for place, edge in enumerate(self.edges):
            yield MessageColumn(edge, self.static, Rows(received, stamps[place], poses[place]),
                                order, self.edges, authorities)


class MessageColumns:
    """Gathers messages, at almost no cost, and returns them by edge."""

    def __init__(self) -> None:
        self._alike: dict[tuple[object, str, bool], _AlikeMessages] = {}
        self._messages = self._count = 0
        self._enough = ENOUGH

    def add(self, arrival: ReceivedMessage) -> bool:
        """Add a message; return whether it is time to pop the columns."""
        edges = arrival.batch.edges
        key = arrival.batch.layout, arrival.topic, arrival.static
        alike = self._alike.get(key)
        if alike is None:
            alike = self._alike[key] = _AlikeMessages(arrival)
            # New names take memory, too.
            self._count += _OF_A_KIND + sum(
                len(parent) + len(child) for parent, child in edges) // _LETTERS
        alike.add(arrival, self._messages)
        self._messages += 1
        # So do empty messages.
        self._count += 1 + len(edges)
        return self._count >= self._enough

    def pop(self) -> list[MessageColumn]:
        """Return all samples since the last call, by edge."""
        alike, self._alike = self._alike, {}
        self._messages = self._count = 0
        parts: dict[tuple[Edge, bool], list[MessageColumn]] = {}
        for messages in alike.values():
            for column in messages.columns():
                parts.setdefault((column.edge, column.static), []).append(column)
        self._enough = min(max(ENOUGH, OF_EACH * len(parts)), _MOST)
        return [_joined(columns) for columns in parts.values()]


def _joined(columns: Sequence[MessageColumn]) -> MessageColumn:
    """Return the columns of one edge as one column, in order of arrival."""
    first, *others = columns
    if not others:
        return first
    order = np.concatenate([column.order for column in columns])
    arrived = np.argsort(order, kind='stable')
    rows = first.rows
    for column in others:
        rows = column.rows.after(rows)
    return first._replace(
        rows=rows[arrived], order=order[arrived],
        beside=list(dict.fromkeys(edge for column in columns for edge in column.beside)),
        authorities=frozenset().union(*(column.authorities for column in columns)))
