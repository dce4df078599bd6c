# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages of the last seconds, and the last static ones, in limited memory."""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

from tf_tree_py.core.messages.observers import ReceivedMessage

# The approximate memory of a message, of each of its transforms, and of each edge's names; all
# messages of one layout share the names.
_MESSAGE_BYTES, _TRANSFORM_BYTES, _EDGE_BYTES = 300, 140, 160

Edges = Sequence[tuple[str, str]]


@dataclass
class _Names:
    """
    The names that some messages share.

    :ivar edges: referenced, so that no other object gets its id.
    :ivar authority: the publisher of the first of these messages; all bytes count as its own.
    """

    edges: Edges
    authority: str
    messages: int = 0

    @property
    def size(self) -> int:
        """Return the approximate memory of the names, bytes."""
        return sum(_EDGE_BYTES + len(parent) + len(child) for parent, child in self.edges)


class RecentMessages:
    """
    Keeps messages; above the limit it removes the oldest of the publisher with the most bytes.

    It is not thread-safe.

    :ivar now: the time of the last arrival, nanoseconds.
    :ivar size: the approximate memory of all messages, bytes.
    """

    def __init__(self, last: int, most_bytes: int) -> None:
        """
        Begin without messages.

        :param last: how long moving transforms are kept, nanoseconds.
        """
        self._last, self._most_bytes = last, most_bytes
        self.now = self.size = 0
        self._moving: deque[ReceivedMessage] = deque()
        # In order of their last renewal.
        self._static: dict[tuple[tuple[str, str], ...], ReceivedMessage] = {}
        self._names: dict[int, _Names] = {}
        self._bytes: Counter[str] = Counter()

    def moving(self) -> list[ReceivedMessage]:
        """Return the messages of moving edges, in the order of arrival."""
        return list(self._moving)

    def static(self) -> list[ReceivedMessage]:
        """Return the last message of each set of static edges, in the order of arrival."""
        return list(self._static.values())

    def add(self, arrival: ReceivedMessage) -> None:
        """Keep a message; remove those that are too old or exceed the memory."""
        if not arrival.received:
            arrival = arrival._replace(received=self.now)
        self.now = arrival.received
        self._count(arrival)
        if arrival.static:
            edges = tuple(arrival.batch.edges)
            before = self._static.pop(edges, None)
            self._static[edges] = arrival
            if before is not None:
                self._discount(before)
        else:
            self._moving.append(arrival)
            self._forget_old()
        while self.size > self._most_bytes:
            self._forget_oldest_of(max(self._bytes, key=self._bytes.__getitem__))

    def _forget_old(self) -> None:
        oldest = self.now - self._last
        # After a jump back of time, the earlier messages are older, although they look newer.
        while self._moving and not oldest <= self._moving[0].received <= self.now:
            self._discount(self._moving.popleft())

    def _forget_oldest_of(self, authority: str) -> None:
        """Remove a publisher's oldest message of moving edges, or else a static one."""
        for place, arrival in enumerate(self._moving):
            if self._names_of(arrival).authority == authority:
                del self._moving[place]
                return self._discount(arrival)
        edges = next(edges for edges, arrival in self._static.items()
                     if self._names_of(arrival).authority == authority)
        self._discount(self._static.pop(edges))

    # --- counting bytes

    def _names_of(self, arrival: ReceivedMessage) -> _Names:
        return self._names[id(arrival.batch.edges)]

    def _count(self, arrival: ReceivedMessage) -> None:
        edges = arrival.batch.edges
        names = self._names.get(id(edges))
        if names is None:
            names = self._names[id(edges)] = _Names(edges, arrival.authority)
            self._charge(names, names.size)
        names.messages += 1
        self._charge(names, _own_size(arrival))

    def _discount(self, arrival: ReceivedMessage) -> None:
        names = self._names_of(arrival)
        names.messages -= 1
        self._charge(names, -_own_size(arrival))
        if not names.messages:
            del self._names[id(names.edges)]
            self._charge(names, -names.size)
            if not self._bytes[names.authority]:
                del self._bytes[names.authority]

    def _charge(self, names: _Names, size: int) -> None:
        self._bytes[names.authority] += size
        self.size += size


def _own_size(arrival: ReceivedMessage) -> int:
    return _MESSAGE_BYTES + _TRANSFORM_BYTES * len(arrival.batch.edges)
