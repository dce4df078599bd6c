# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The queue of waiters, sorted by the edges that they wait for.

Waiters do not poll. A waiter is queued under every edge that may change the answer of its
query (``errors.Blocker``). When one of these edges has changed, the waiter is removed, and
its query runs again. This file only keeps the queues: it neither sleeps nor reads a clock, and
the buffer's lock protects it.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterable
import itertools
import threading

from .. import fork_locks
from ..callbacks import call_all
from ..errors import Blocker

_Entry = tuple[int, int, 'Waiter']


class Waiter:
    """
    A waiter: its query failed, and may succeed later.

    :ivar wake: called without the lock when the query should run again.
    """

    __slots__ = ('wake', 'number', 'places')

    def __init__(self, wake: Callable[[], None]) -> None:
        self.wake = wake
        self.number = 0
        self.places: tuple[Blocker, ...] = ()

    @property
    def waits(self) -> bool:
        """Return whether it is in any queue."""
        return bool(self.places)


class Waiters:
    """
    All waiters: a queue for each edge, sorted by the stamp that the edge must reach.

    A waiter may be queued under several edges; when one of them is ready, it leaves all.
    Adding, removing and finding the ready ones cost O(log n) and a memmove for each
    edge.

    :ivar somebody: set while there is a waiter.
    """

    def __init__(self) -> None:
        self.somebody = threading.Event()
        self._lines: dict[str | None, list[_Entry]] = {}
        self._numbers = itertools.count()
        self._count = 0
        fork_locks.repair(self)

    def __bool__(self) -> bool:
        return self._count > 0

    def __len__(self) -> int:
        return self._count

    def repair_in_child(self) -> None:
        """Forget the waiters of the parent process, whose threads do not exist here."""
        for line in self._lines.values():
            for _, _, waiter in line:
                waiter.places = ()
        self._lines.clear()
        self._count = 0
        self.somebody = threading.Event()  # a thread may have held the lock inside the old one

    def add(self, waiter: Waiter, blockers: Iterable[Blocker]) -> None:
        """Queue a waiter under all its blockers, instead of where it was queued before."""
        self.discard(waiter)
        waiter.places = tuple(set(blockers))
        waiter.number = next(self._numbers)
        for child, stamp in waiter.places:
            insort(self._lines.setdefault(child, []), (stamp, waiter.number, waiter))
        self._count += 1
        self.somebody.set()

    def discard(self, waiter: Waiter) -> None:
        """Remove a waiter from all queues."""
        if not waiter.places:
            return
        for child, stamp in waiter.places:
            line = self._lines[child]
            del line[bisect_left(line, (stamp, waiter.number))]
            if not line:
                del self._lines[child]
        waiter.places = ()
        self._count -= 1
        if not self._count:
            self.somebody.clear()

    def take_reached(self, child: str, latest: int) -> list[Waiter]:
        """Remove and return the waiters for stamps that an edge has now reached."""
        line = self._lines.get(child)
        return [] if line is None else self._take(line[:bisect_left(line, (latest + 1,))])

    def take_all(self) -> list[Waiter]:
        """Remove and return all waiters: the structure changed, or their waits must fail."""
        return self._take([entry for line in self._lines.values() for entry in line])

    def _take(self, entries: Iterable[_Entry]) -> list[Waiter]:
        taken = list({number: waiter for _, number, waiter in entries}.values())
        for waiter in taken:
            self.discard(waiter)
        return taken


def wake_all(waiters: Iterable[Waiter]) -> None:
    """
    Wake waiters; the caller must not hold the buffer's lock.

    :raises BaseException: the first exception that one of them raised, after all were woken.
    """
    call_all(waiter.wake for waiter in waiters)
