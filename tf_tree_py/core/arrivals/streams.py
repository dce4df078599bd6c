"""
Which edges of a topic two publishers send, told from the numbers of their messages.

A message does not say who sent it, but every publisher counts its own. No publishers
and no graph here: whoever knows when one of them left says so.
"""

from collections.abc import Sequence
import math
from random import random

Edge = tuple[str, str]

# So often the numbers of an edge have to fall back into a stream that is known.
_RETURNS = 3
# Of an edge; more than these do not go on beside each other.
_MAX_STREAMS = 8
# Characters of all names together, and what an edge takes besides: somebody makes up frames.
_MAX_CHARACTERS = 2_000_000
_EDGE_CHARACTERS = 300


class Streams:
    """
    Tells the edges that two publishers send.

    The numbers of one publisher rise, however many get lost and whatever else it sends
    between. So where those of an edge fall, a second stream has begun: a publisher that
    was restarted, or a second one. The first does not come back; where numbers fall back
    into a stream that was known, and again, two go on beside each other.

    Of what moves, one edge of a message is looked at, any of them, so that it costs the
    same however many there are. What is static is sent once, so all
    of it is looked at, and the first fall is told: that needs someone who knows whether
    all who ever sent are still there.

    For one topic; not safe for several threads.
    """

    def __init__(self, static: bool) -> None:
        """Begin with nothing known."""
        self._static = static
        self._edges: dict[Edge, _Numbers] = {}
        self._told: set[Edge] = set()
        self._characters = 0

    def follow(self, edges: Sequence[Edge], number: int) -> Sequence[Edge]:
        """
        Take note of a message, of one edge at least.

        :param number: how its publisher counts it.
        :return: the edges that two publishers seem to send; again and again, until they
            are ``told``.
        """
        if self._static:
            return [edge for edge in edges if self._is_contested(edge, number)]
        # By chance, for two publishers may number their messages in step.
        edge = edges[int(random() * len(edges))]
        numbers = self._edges.get(edge)
        if numbers is not None and numbers.last < number <= numbers.ceiling:
            numbers.last = number
            return ()
        return (edge,) if self._is_contested(edge, number) else ()

    def told(self, edge: Edge) -> None:
        """Say no more of an edge."""
        self._told.add(edge)

    def begin_anew(self) -> None:
        """Forget all numbers, for a publisher has left: which of them were its, nobody knows."""
        self._edges.clear()
        self._characters = sum(map(_characters, self._told))

    def _is_contested(self, edge: Edge, number: int) -> bool:
        if edge in self._told:
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
            self._told.clear()
            self._characters = _characters(edge)
        if self._characters <= _MAX_CHARACTERS:
            self._edges[edge] = _Numbers(number)


class _Numbers:
    """
    The numbers of one edge, sorted into as few streams that rise as there can be.

    A number continues the stream whose last number is nearest below it.

    :ivar last: the last number of the stream that came last.
    :ivar ceiling: up to here a number continues that one.
    :ivar returns: how often numbers fell back into another stream.
    """

    __slots__ = ('last', 'ceiling', 'returns', '_others')

    def __init__(self, number: int) -> None:
        self.last = number
        self.ceiling: float = math.inf
        self.returns = 0
        # The last numbers of the other streams; the one that came last at the end.
        self._others: list[int] = []

    def sort_in(self, number: int) -> None:
        """Find the stream that a number continues, or begin one."""
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
