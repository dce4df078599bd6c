"""Which edges of a topic two publishers send, by the numbers of messages and by the graph."""

from collections.abc import Sequence
from typing import Any

from tf_tree_py.core.arrivals.incidents import Incident, Kind
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.arrivals.streams import Edge, Streams

from .authority import Authority


class Rivals:
    """
    Tells each edge that two publishers send, once.

    While the graph knows of no second publisher on the topic, nothing is done about what
    moves. When a publisher leaves, all that was known of numbers is forgotten, so that one
    that is restarted is no second one. Where the middleware does not number messages,
    nothing is told.
    """

    def __init__(self, authority: Authority, static: bool) -> None:
        """
        Begin with nothing known.

        :param authority: of the topic.
        :param static: whether what comes is sent once, and not over and over.
        """
        self._authority = authority
        self._static = static
        self._streams = Streams(static)
        self._endpoints = authority.endpoints

    def follow(self, batch: Batch, info: Any) -> list[Incident]:
        """
        Take note of a message of one transform at least, and return what to tell.

        :param info: what rclpy says of the message beside its content.
        """
        authority = self._authority
        if authority.endpoints is not self._endpoints:
            self._forget_if_one_left()
        if len(self._endpoints) < 2 and not self._static:
            return []
        number = info['publication_sequence_number']
        if number is None:
            return []
        suspects = self._streams.follow(batch.edges, number)
        return self._judged(suspects, batch, number) if suspects else []

    def _forget_if_one_left(self) -> bool:
        before, self._endpoints = self._endpoints, self._authority.endpoints
        one_left = bool(before - self._endpoints)
        if one_left:
            self._streams.begin_anew()
        return one_left

    def _judged(self, suspects: Sequence[Edge], batch: Batch, number: int) -> list[Incident]:
        """Return what to tell of edges that two seem to send, by the graph as it is now."""
        self._authority.ask()
        if self._forget_if_one_left():
            # It was restarted, most likely: what came now is the first of another run.
            self._streams.follow(batch.edges, number)
            return []
        names = self._authority.names
        # A node that crashed stays in the graph for a while, beside the one that takes its place
        # under its name; but what moves has come from both by now.
        if len(names) < 2 or (self._static and len(set(names)) < 2):
            return []
        stamps = dict(zip(batch.edges, batch.stamps, strict=True))
        for edge in suspects:
            self._streams.told(edge)
        return [self._incident(edge, stamps[edge], names) for edge in suspects]

    def _incident(self, edge: Edge, stamp: int, names: Sequence[str]) -> Incident:
        parent, child = (name.removeprefix('/') for name in edge)
        return Incident(
            Kind.TWO_PUBLISHERS, parent, child, stamp, self._authority.name(),
            f'{_both(names)} send it, as the numbers of its messages show; what they say gets '
            'mixed, and every lookup through it depends on who came last. Stop one of them')


def _both(names: Sequence[str]) -> str:
    """Return who the two are, as far as that is known."""
    if len(names) > 2:
        return f'two of {", ".join(names)}'
    first, second = names
    return f'two publishers of {first}' if first == second else f'both {first} and {second}'
