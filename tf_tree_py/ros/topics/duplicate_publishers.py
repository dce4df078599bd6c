# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finds edges that two publishers send, by their message numbers and the ROS graph."""

from collections.abc import Sequence
from typing import Any

from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.duplicate_streams import DuplicateStreams, Edge

from .publisher_names import PublisherNames


class DuplicatePublishers:
    """
    Reports each edge of a topic that two publishers send, once.

    It reports an edge again if two still send it after another publisher has left.

    While the graph shows one publisher, messages of ``/tf`` are not examined. When a publisher
    leaves, all numbers are forgotten, so that a restarted node does not count as a second
    publisher. If the middleware does not number messages, nothing is reported.
    """

    def __init__(self, authority: PublisherNames, static: bool) -> None:
        """
        Begin without any numbers.

        :param authority: of the topic.
        :param static: whether each edge is sent once, as on ``/tf_static``.
        """
        self._authority = authority
        self._static = static
        self._streams = DuplicateStreams(static)
        self._endpoints = authority.endpoints

    def judge(self, batch: Batch, info: Any) -> list[Incident]:
        """
        Examine a message of at least one transform, and return the incidents to report.

        :param info: rclpy's message info.
        """
        authority = self._authority
        if authority.endpoints is not self._endpoints:
            self._forget_if_one_left()
        if len(self._endpoints) < 2 and not self._static:
            return []
        number = info['publication_sequence_number']
        if number is None:
            return []
        suspects = self._streams.take(batch.edges, number)
        return self._judged(suspects, batch, number) if suspects else []

    def _forget_if_one_left(self) -> bool:
        before, self._endpoints = self._endpoints, self._authority.endpoints
        one_left = bool(before - self._endpoints)
        if one_left:
            self._streams.begin_anew()
        return one_left

    def _judged(self, suspects: Sequence[Edge], batch: Batch, number: int) -> list[Incident]:
        """Return the incidents of suspected edges that the current graph confirms."""
        self._authority.ask()
        if self._forget_if_one_left():
            # The publisher was most likely restarted, and this is its first message.
            self._streams.take(batch.edges, number)
            return []
        names = self._authority.names
        # A crashed node stays in the graph for a while, along with its replacement of the same
        # name. So two static publishers count only if their names differ. Of two publishers of
        # moving transforms, both have sent some by now.
        if len(names) < 2 or (self._static and len(set(names)) < 2):
            return []
        stamps = dict(zip(batch.edges, batch.stamps, strict=True))
        for edge in suspects:
            self._streams.mark_reported(edge)
        return [self._incident(edge, stamps[edge], names) for edge in suspects]

    def _incident(self, edge: Edge, stamp: int, names: Sequence[str]) -> Incident:
        parent, child = (name.removeprefix('/') for name in edge)
        return Incident(
            Kind.TWO_PUBLISHERS, parent, child, stamp, self._authority.name(),
            f'{_both(names)} send it, as the numbers of its messages show. Their values are '
            'mixed, and every lookup through it uses whichever arrived last. Stop one of them')


def _both(names: Sequence[str]) -> str:
    """Return the names of the two publishers, as far as they are known."""
    if len(names) > 2:
        return f'two of {", ".join(names)}'
    first, second = names
    return f'two publishers of {first}' if first == second else f'both {first} and {second}'
