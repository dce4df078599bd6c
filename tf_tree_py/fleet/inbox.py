# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Queues of messages, one for each robot, that share one decoding thread fairly.

The robot that has used the least time of this thread is served next (start-time fair queuing:
P. Goyal, H. M. Vin, H. Cheng, IEEE/ACM Transactions on Networking 5(5), 1997). So a robot with
many or costly messages delays only itself. This file does not depend on Zenoh.
"""

from collections import deque
from dataclasses import dataclass, field
import heapq
import threading
from typing import Generic, NamedTuple, TypeVar

Item = TypeVar('Item')

DEFAULT_WAITING = 64_000_000
"""The most bytes that wait, of all robots together."""
# About the memory of a message in addition to its bytes.
_OVERHEAD = 500


class _Waiting(NamedTuple, Generic[Item]):
    item: Item
    size: int


@dataclass
class _Line(Generic[Item]):
    """
    The queue of one robot.

    :ivar served: the virtual time at which its next turn begins, seconds.
    :ivar has_turn: whether it is scheduled, or is being served.
    """

    served: float = 0.0
    has_turn: bool = False
    size: int = 0
    waiting: deque[_Waiting[Item]] = field(default_factory=deque)

    def drop_oldest(self) -> int:
        """Drop the oldest item; return its size."""
        size = self.waiting.popleft().size
        self.size -= size
        return size


class Inbox(Generic[Item]):
    """A queue for each robot; any thread may put items, and one thread takes them."""

    def __init__(self, most_of_one: int, most_of_all: int = DEFAULT_WAITING) -> None:
        """
        Begin empty.

        :param most_of_one: the most bytes of one robot; beyond it, its oldest items are dropped.
        :param most_of_all: the most bytes of all robots; beyond it, the oldest items of the robot
            with the most bytes are dropped.
        """
        self._most_of_one, self._most_of_all = most_of_one, most_of_all
        self._changed = threading.Condition()
        self._lines: dict[str, _Line[Item]] = {}
        # The schedule: (virtual time, robot) of each robot whose queue is not empty.
        self._turns: list[tuple[float, str]] = []
        self._now = 0.0
        self._size = 0
        self._closed = False

    def put(self, robot: str, item: Item, size: int) -> list[str]:
        """Add an item; return the robots whose items were dropped for it, one entry per item."""
        with self._changed:
            line = self._lines.setdefault(robot, _Line())
            dropped = []
            while line.waiting and line.size + size + _OVERHEAD > self._most_of_one:
                self._size -= line.drop_oldest()
                dropped.append(robot)
            if not line.has_turn:
                self._begin_turn(robot, line)
            line.waiting.append(_Waiting(item, size + _OVERHEAD))
            line.size += size + _OVERHEAD
            self._size += size + _OVERHEAD
            while self._size > self._most_of_all:
                heaviest = max(self._lines, key=lambda name: self._lines[name].size)
                self._size -= self._lines[heaviest].drop_oldest()
                dropped.append(heaviest)
            self._changed.notify()
            return dropped

    def take(self) -> tuple[str, Item] | None:
        """Return the next item, as soon as there is one; None: the inbox is closed."""
        with self._changed:
            while not self._closed:
                while self._turns:
                    self._now, robot = heapq.heappop(self._turns)
                    line = self._lines[robot]
                    if line.waiting:
                        item = line.waiting[0].item
                        self._size -= line.drop_oldest()
                        return robot, item
                    line.has_turn = False
                self._changed.wait()
            return None

    def charge(self, robot: str, seconds: float) -> None:
        """Charge a robot for the processor time of the item that was taken last."""
        with self._changed:
            line = self._lines[robot]
            line.served += seconds
            line.has_turn = False
            if line.waiting:
                self._begin_turn(robot, line)

    def close(self) -> None:
        """Close the inbox: items that still wait are never taken."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _begin_turn(self, robot: str, line: _Line[Item]) -> None:
        # A robot saves up no time while its queue is empty.
        line.served = max(line.served, self._now)
        line.has_turn = True
        heapq.heappush(self._turns, (line.served, robot))
