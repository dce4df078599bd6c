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

"""
Who waits for what, and what wakes them.

Nothing polls. A waiter stands in line under every edge that may change the answer of its
query (``errors.Blocker``), and is taken out when one of these edges has changed, to ask
again. This file only keeps the lines: it neither sleeps nor reads a clock, and the
buffer's lock guards it.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterable
import itertools
import threading

from ..calling import call_all
from ..errors import Blocker

_Entry = tuple[int, int, 'Waiter']


class Waiter:
    """
    One who waits: its query failed, and may succeed later.

    :ivar wake: called without the lock when it is time to ask again.
    """

    __slots__ = ('wake', 'number', 'places')

    def __init__(self, wake: Callable[[], None]) -> None:
        self.wake = wake
        self.number = 0
        self.places: tuple[Blocker, ...] = ()

    @property
    def waits(self) -> bool:
        """Return whether it stands in any line."""
        return bool(self.places)


class Waiters:
    """
    All who wait, sorted under each edge by the stamp that it must reach for them.

    A waiter may stand under several edges; when one of them is ready, it leaves all.
    Adding, removing and finding the ready ones cost O(log n) and a memmove for each
    edge.

    :ivar somebody: set while anybody waits.
    """

    def __init__(self) -> None:
        self.somebody = threading.Event()
        self._lines: dict[str | None, list[_Entry]] = {}
        self._numbers = itertools.count()
        self._count = 0

    def __bool__(self) -> bool:
        return self._count > 0

    def __len__(self) -> int:
        return self._count

    def add(self, waiter: Waiter, blockers: Iterable[Blocker]) -> None:
        """Put a waiter in line under all its blockers; it leaves the lines where it stood."""
        self.discard(waiter)
        waiter.places = tuple(set(blockers))
        waiter.number = next(self._numbers)
        for child, stamp in waiter.places:
            insort(self._lines.setdefault(child, []), (stamp, waiter.number, waiter))
        self._count += 1
        self.somebody.set()

    def discard(self, waiter: Waiter) -> None:
        """Take a waiter out of all lines."""
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
        """Take out all who waited for an edge to reach a stamp up to its latest."""
        line = self._lines.get(child)
        return [] if line is None else self._take(line[:bisect_left(line, (latest + 1,))])

    def take_all(self) -> list[Waiter]:
        """Take out everybody: the structure changed, or the wait is to fail."""
        return self._take([entry for line in self._lines.values() for entry in line])

    def _take(self, entries: Iterable[_Entry]) -> list[Waiter]:
        taken = list({number: waiter for _, number, waiter in entries}.values())
        for waiter in taken:
            self.discard(waiter)
        return taken


def wake_all(waiters: Iterable[Waiter]) -> None:
    """
    Wake waiters; not to be called with the buffer's lock held.

    :raises BaseException: what the first of them raised, once all are awake.
    """
    call_all(waiter.wake for waiter in waiters)
