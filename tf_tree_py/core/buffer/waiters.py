"""
Who waits for what, and what wakes them.

Nothing polls: a waiter stands under all that may change its fate (``errors.Blocker``),
and is handed out when something of that did, to try again. No waiting, no threads and
no clocks here; the buffer's lock guards it all.
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
    Somebody whose query failed and may succeed later.

    :ivar wake: called, without the lock, when it is time to try again.
    """

    __slots__ = ('wake', 'number', 'places')

    def __init__(self, wake: Callable[[], None]) -> None:
        self.wake = wake
        self.number = 0
        self.places: tuple[Blocker, ...] = ()

    @property
    def waits(self) -> bool:
        """Return whether it stands anywhere."""
        return bool(self.places)


class Waiters:
    """
    All who wait, sorted under each edge by the stamp that it must reach for them.

    A waiter may stand under several edges; when one of them is ready, it leaves all.
    Adding, removing and finding the ready ones cost O(log n) and a memmove for each
    edge, however many wait.

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
        """Put a waiter under all that may change its fate, out of where it stood before."""
        self.discard(waiter)
        waiter.places = tuple(set(blockers))
        waiter.number = next(self._numbers)
        for child, stamp in waiter.places:
            insort(self._lines.setdefault(child, []), (stamp, waiter.number, waiter))
        self._count += 1
        self.somebody.set()

    def discard(self, waiter: Waiter) -> None:
        """Take a waiter out, if it stands anywhere."""
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
        """Take out those for whom an edge had to reach a stamp, and has."""
        line = self._lines.get(child)
        return [] if line is None else self._take(line[:bisect_left(line, (latest + 1,))])

    def take_all(self) -> list[Waiter]:
        """Take out everybody: the structure changed, or all is lost."""
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
