"""
Who waits for what, and what wakes them.

Nothing polls: a waiter stands under what blocks it (``errors.Blocker``), and is
handed out when that changed, to try again. No waiting, no threads and no clocks
here; the buffer's lock guards it all.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterable
import itertools
import threading

from .calling import call_all
from .errors import Blocker

_Entry = tuple[int, int, 'Waiter']


class Waiter:
    """
    Somebody whose query failed and may succeed later.

    :ivar wake: called, without the lock, when it is time to try again.
    """

    __slots__ = ('wake', 'place')

    def __init__(self, wake: Callable[[], None]) -> None:
        self.wake = wake
        self.place: tuple[str | None, int, int] | None = None


class Waiters:
    """
    All who wait, sorted under each blocking edge by the stamp they wait for.

    A waiter stands in one place at a time. Adding, removing and finding the ready
    ones cost O(log n) and a memmove, however many wait.

    :ivar somebody: set while anybody waits.
    """

    def __init__(self) -> None:
        self.somebody = threading.Event()
        self._lines: dict[str | None, list[_Entry]] = {}
        self._numbers = itertools.count()

    def __bool__(self) -> bool:
        return bool(self._lines)

    def __len__(self) -> int:
        return sum(map(len, self._lines.values()))

    def add(self, waiter: Waiter, blocker: Blocker) -> None:
        """Put a waiter under what blocks it, out of where it stood before."""
        self.discard(waiter)
        child, stamp = blocker
        number = next(self._numbers)
        insort(self._lines.setdefault(child, []), (stamp, number, waiter))
        self.somebody.set()
        waiter.place = (child, stamp, number)

    def discard(self, waiter: Waiter) -> None:
        """Take a waiter out, if it stands anywhere."""
        if waiter.place is None:
            return
        child, stamp, number = waiter.place
        line = self._lines[child]
        del line[bisect_left(line, (stamp, number))]
        self._drop_if_empty(child)
        waiter.place = None

    def take_reached(self, child: str, latest: int) -> list[Waiter]:
        """Take out those who wait for samples of a child frame up to a stamp."""
        line = self._lines.get(child)
        if line is None:
            return []
        count = bisect_left(line, (latest + 1,))
        return self._take(child, count)

    def take_all(self) -> list[Waiter]:
        """Take out everybody: the structure changed, or all is lost."""
        return [waiter for child in list(self._lines)
                for waiter in self._take(child, len(self._lines[child]))]

    def _take(self, child: str | None, count: int) -> list[Waiter]:
        line = self._lines[child]
        taken = [waiter for _, _, waiter in line[:count]]
        del line[:count]
        self._drop_if_empty(child)
        for waiter in taken:
            waiter.place = None
        return taken

    def _drop_if_empty(self, child: str | None) -> None:
        if not self._lines[child]:
            del self._lines[child]
        if not self._lines:
            self.somebody.clear()


def wake_all(waiters: Iterable[Waiter]) -> None:
    """
    Wake waiters; not to be called with the buffer's lock held.

    :raises BaseException: what the first of them raised, once all are awake.
    """
    call_all(waiter.wake for waiter in waiters)
