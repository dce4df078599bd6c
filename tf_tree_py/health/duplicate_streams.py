# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Finding the edges of a topic that two publishers send, by the sequence numbers of messages.

A message does not name its sender, but every publisher numbers its messages. This file does
not use the ROS graph: its caller reports when a publisher has left.
"""

from collections.abc import Sequence
import math
from random import random

Edge = tuple[str, str]

# How often the numbers of an edge must fall back into a known stream to prove two publishers.
_RETURNS = 3
# More streams of one edge than this are not remembered.
_MAX_STREAMS = 8
# A hostile publisher may invent frames, so the memory is limited: the characters of all names
# together, plus the overhead of each edge, expressed in characters.
_MAX_CHARACTERS = 2_000_000
_EDGE_CHARACTERS = 300


class DuplicateStreams:
    """
    Finds the edges that two publishers send.

    The numbers of one publisher rise, even if messages are lost or contain other edges.
    So if the numbers of an edge fall, a second stream has begun: a publisher was
    restarted, or there are two. After a restart the first stream never continues. If numbers
    fall back into a known stream several times, two publishers send concurrently.

    Of each message of moving transforms one random edge is examined, so that large messages
    cost no more than small ones. A static edge is sent once, so all edges of a static message
    are examined, and the first fall counts. The caller must then check that all publishers
    still exist.

    One instance serves one topic, and is not thread-safe.
    """

    def __init__(self, static: bool) -> None:
        """Start without any edge."""
        self._static = static
        self._edges: dict[Edge, _Numbers] = {}
        self._reported: set[Edge] = set()
        self._characters = 0

    def examine(self, edges: Sequence[Edge], number: int) -> Sequence[Edge]:
        """
        Examine a message.

        :param edges: of its transforms; none if all were refused.
        :param number: its sequence number.
        :return: the edges that two publishers seem to send. An edge is returned every time
            until ``mark_reported`` is called for it.
        """
        if self._static or not edges:
            return [edge for edge in edges if self._is_contested(edge, number)]
        # A fixed choice would miss edges where two publishers number their messages in step.
        edge = edges[int(random() * len(edges))]
        numbers = self._edges.get(edge)
        if numbers is not None and numbers.last < number <= numbers.ceiling:
            numbers.last = number
            return ()
        return (edge,) if self._is_contested(edge, number) else ()

    def mark_reported(self, edge: Edge) -> None:
        """Stop returning an edge, which was reported, until ``begin_anew``."""
        self._reported.add(edge)

    @property
    def is_empty(self) -> bool:
        """Return whether no numbers are known."""
        return not self._edges

    def begin_anew(self) -> None:
        """Forget all numbers: a publisher has left, and its numbers cannot be identified."""
        self._edges.clear()
        self._reported.clear()
        self._characters = 0

    def _is_contested(self, edge: Edge, number: int) -> bool:
        if edge in self._reported:
            return False
        numbers = self._edges.get(edge)
        if numbers is None:
            self._begin(edge, number)
            return False
        fell = number <= numbers.last
        numbers.sort_in(number)
        return fell if self._static else numbers.returns >= _RETURNS

    def _begin(self, edge: Edge, number: int) -> None:
        self._characters += _characters(edge)
        if self._characters > _MAX_CHARACTERS:
            self._edges.clear()
            self._reported.clear()
            self._characters = _characters(edge)
        if self._characters <= _MAX_CHARACTERS:
            self._edges[edge] = _Numbers(number)


class _Numbers:
    """
    The numbers of one edge, sorted into rising streams, as few as possible.

    A number continues the stream whose last number is the nearest below it.

    :ivar last: the last number of the current stream, which has the latest message.
    :ivar ceiling: numbers above ``last`` and up to here continue the current stream.
    :ivar returns: how often a number fell back into another stream.
    """

    __slots__ = ('last', 'ceiling', 'returns', '_others')

    def __init__(self, number: int) -> None:
        self.last = number
        self.ceiling: float = math.inf
        self.returns = 0
        # The last numbers of the other streams; the stream with the latest message is last.
        self._others: list[int] = []

    def sort_in(self, number: int) -> None:
        """Add a number to the stream that it continues, or to a new one."""
        last, others = self.last, self._others
        nearest = max((other for other in others if other < number), default=None)
        if number <= last or (nearest is not None and nearest > last):
            if nearest is not None:
                others.remove(nearest)
                self.returns += number <= last
            others.append(last)
            del others[:-_MAX_STREAMS]
        self.last = number
        self.ceiling = min((other for other in others if other > number), default=math.inf)


def _characters(edge: Edge) -> int:
    return _EDGE_CHARACTERS + len(edge[0]) + len(edge[1])
