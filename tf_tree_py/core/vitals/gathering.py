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

"""Messages that came, gathered until there are enough to be looked at together."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .stretch import Rows
from ..arrivals.received import Received

Edge = tuple[str, str]

# How many transforms to gather, and how many of each edge: enough for numpy to cost little for
# each of them, and few enough to take some megabytes only.
_ENOUGH, _OF_EACH, _MOST = 20_000, 100, 100_000


class Column(NamedTuple):
    """
    What arrived of one edge on topics of one kind.

    :ivar rows: in order of arrival.
    :ivar order: (N,) the number of each row's message.
    :ivar beside: the edges of the last message that had it, itself among them.
    :ivar authorities: who sent it.
    """

    edge: Edge
    static: bool
    rows: Rows
    order: npt.NDArray[np.int64]
    beside: Sequence[Edge]
    authorities: frozenset[str]


class Gathering:
    """Takes messages, which costs next to nothing, and gives them back by edge."""

    def __init__(self) -> None:
        self._arrivals: list[Received] = []
        self._count = 0
        self._enough = _ENOUGH

    def add(self, arrival: Received) -> bool:
        """Take a message; return whether it is time to take the columns."""
        self._arrivals.append(arrival)
        # An empty message takes memory too.
        self._count += 1 + len(arrival.batch.edges)
        return self._count >= self._enough

    def take(self) -> list[Column]:
        """Return all that has come since the last time, by edge."""
        arrivals, self._arrivals, self._count = self._arrivals, [], 0
        parts: dict[tuple[Edge, bool], list[Column]] = {}
        for column in _columns(arrivals):
            parts.setdefault((column.edge, column.static), []).append(column)
        self._enough = min(max(_ENOUGH, _OF_EACH * len(parts)), _MOST)
        return [_joined(columns) for columns in parts.values()]


def _columns(arrivals: Sequence[Received]) -> Iterator[Column]:
    """Yield a column for each edge of each kind of message."""
    alike: dict[tuple[int, str], list[int]] = {}
    for number, arrival in enumerate(arrivals):
        # All messages of one layout have one object for their edges, and live until we are done.
        alike.setdefault((id(arrival.batch.edges), arrival.topic), []).append(number)
    for numbers in alike.values():
        group = [arrivals[number] for number in numbers]
        edges, static = group[0].batch.edges, group[0].static
        received = np.array([arrival.received for arrival in group], np.int64)
        stamps = np.array([arrival.batch.stamps for arrival in group], np.int64)
        poses = np.frombuffer(b''.join(
            pose for arrival in group for pose in arrival.batch.poses)
        ).reshape(len(group), len(edges), 7)
        order = np.array(numbers, np.int64)
        authorities = frozenset(arrival.authority for arrival in group) - {''}
        for place, edge in enumerate(edges):
            yield Column(edge, static, Rows(received, stamps[:, place], poses[:, place]), order,
                         edges, authorities)


def _joined(columns: Sequence[Column]) -> Column:
    """Return one edge's columns as one, in order of arrival."""
    if len(columns) == 1:
        return columns[0]
    order = np.concatenate([column.order for column in columns])
    arrived = np.argsort(order, kind='stable')
    rows = columns[0].rows
    for column in columns[1:]:
        rows = column.rows.after(rows)
    return columns[-1]._replace(
        rows=rows[arrived], order=order[arrived],
        authorities=frozenset().union(*(column.authorities for column in columns)))
