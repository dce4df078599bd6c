# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Received messages, gathered until there are enough to process together."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.messages.observers import ReceivedMessage

from .sample_rows import Rows

Edge = tuple[str, str]

# How many transforms to gather, how many of each edge, and how many at most: enough to make
# numpy's cost per transform small, and few enough to take only some megabytes.
_ENOUGH, _OF_EACH, _MOST = 30_000, 100, 100_000
# This many characters of names take about as much memory as a transform.
_LETTERS = 10
# Messages that are not like any other take as much memory as this many more transforms.
_OF_A_KIND = 6


class MessageColumn(NamedTuple):
    """
    The samples of one edge on topics of one kind.

    :ivar rows: in order of arrival.
    :ivar order: (N,) the number of each row's message.
    :ivar beside: the edges of the last message that contained it, including itself.
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
        self._alike: dict[tuple[int | Edge, str, bool], _AlikeMessages] = {}
        self._messages = self._count = 0
        self._enough = _ENOUGH

    def add(self, arrival: ReceivedMessage) -> bool:
        """Add a message; return whether it is time to take the columns."""
        edges = arrival.batch.edges
        # All messages of one layout share one object for their edges; but each transform that a
        # program inserts itself has its own object.
        layout = edges[0] if len(edges) == 1 else id(edges)
        key = layout, arrival.topic, arrival.static
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

    def take(self) -> list[MessageColumn]:
        """Return all samples since the last call, by edge."""
        alike, self._alike = self._alike, {}
        self._messages = self._count = 0
        parts: dict[tuple[Edge, bool], list[MessageColumn]] = {}
        for messages in alike.values():
            for column in messages.columns():
                parts.setdefault((column.edge, column.static), []).append(column)
        self._enough = min(max(_ENOUGH, _OF_EACH * len(parts)), _MOST)
        return [_joined(columns) for columns in parts.values()]


def _joined(columns: Sequence[MessageColumn]) -> MessageColumn:
    """Return the columns of one edge as one column, in order of arrival."""
    if len(columns) == 1:
        return columns[0]
    order = np.concatenate([column.order for column in columns])
    arrived = np.argsort(order, kind='stable')
    rows = columns[0].rows
    for column in columns[1:]:
        rows = column.rows.after(rows)
    newest = max(columns, key=lambda column: int(column.order[-1]))
    return newest._replace(
        rows=rows[arrived], order=order[arrived],
        authorities=frozenset().union(*(column.authorities for column in columns)))
