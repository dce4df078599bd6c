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
Who watches a buffer: what arrives, what is refused and why, what is asked.

Every tool that looks on is an ``Observer``; nothing else needs to be replaced or
overridden to see what happens. A buffer that nobody watches pays nothing for this.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import threading
from typing import Any, TypeVar

from .incidents import Incident
from .received import Received
from ..errors import TransformException
from ..stamp import LATEST

Answer = TypeVar('Answer')

AUDIT_FOLDER = 'TF_TREE_PY_AUDIT'
"""The environment variable that lets an audit watch every buffer; see ``tf_audit``."""

# Target frame, source frame, stamp; None: the latest.
Asked = tuple[str, str, int | None]
End = Callable[[TransformException | None], None]


class Observer:
    """
    One who watches a buffer; a subclass overrides what it wants to hear of.

    All methods are called in the thread in which it happens, of several threads perhaps
    at once. They have to be quick, must not wait, and must not raise.
    """

    def received(self, arrival: Received) -> None:
        """
        Hear of a whole message, static ones too, that a listener or a recording delivers.

        It comes before ``arrived`` and ``saw_incidents``. What a program inserts by hand has
        neither a topic nor a time of arrival, and is not told here.
        """

    def arrived(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int]) -> None:
        """
        Hear of moving transforms that are about to be inserted, or refused.

        :param edges: (parent, child) of each.
        :param stamps: of each, nanoseconds.
        """

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Hear what was refused or odd, with its reason; the buffer's lock is held."""

    def asked(self, target: str, source: str, stamp: int | None) -> End | None:
        """
        Hear of a lookup that begins; in the thread that asks, with its calls on the stack.

        A lookup that waits, or is a future, is one lookup however often it tries. A lookup
        between two times is told as its two halves, and one at many stamps by the newest.

        :param target: what was asked for; it need not be the name of a frame.
        :param source: likewise.
        :param stamp: nanoseconds; None: the latest.
        :return: a function that is called when it has ended, with the error or None, in any
            thread. Lookups that this function makes are not told.
        """


class Observers:
    """
    All who watch one buffer.

    :ivar of_messages: those who hear of whole messages.
    :ivar of_arrivals: those who hear what arrives.
    :ivar of_incidents: those who hear what was refused or odd.
    :ivar of_lookups: those who hear what is asked.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._all: tuple[Observer, ...] = ()
        # For each thread: whether it is inside of a lookup that was told already.
        self._inside = threading.local()
        self._sort()

    def __len__(self) -> int:
        return len(self._all)

    def add(self, observer: Observer) -> None:
        """Let somebody watch from now on."""
        with self._lock:
            self._all += (observer,)
            self._sort()

    def remove(self, observer: Observer) -> None:
        """Let somebody go; nothing happens if they do not watch."""
        with self._lock:
            self._all = tuple(other for other in self._all if other is not observer)
            self._sort()

    def _sort(self) -> None:
        self.of_messages = self._who('received')
        self.of_arrivals = self._who('arrived')
        self.of_incidents = self._who('saw_incidents')
        self.of_lookups = self._who('asked')

    def _who(self, hears: str) -> tuple[Observer, ...]:
        return tuple(observer for observer in self._all
                     if getattr(type(observer), hears) is not getattr(Observer, hears))

    # --- telling them

    def tell_received(self, arrival: Received) -> None:
        """Tell of a message that a listener or a recording delivers."""
        for observer in self.of_messages:
            observer.received(arrival)

    def tell_arrived(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int]) -> None:
        """Tell what is about to be inserted."""
        for observer in self.of_arrivals:
            observer.arrived(edges, stamps)

    def tell_incidents(self, incidents: Sequence[Incident]) -> None:
        """Tell what was refused or odd."""
        for observer in self.of_incidents:
            observer.saw_incidents(incidents)

    def hear_lookups(self) -> bool:
        """Return whether to tell of a lookup: somebody listens, and no other one is under way."""
        return bool(self.of_lookups) and not getattr(self._inside, 'is_told', False)

    def begin(self, *lookups: Asked) -> End:
        """Tell of lookups that begin; return what to call when they have ended."""
        if not self.hear_lookups():
            return _nothing
        ends = [observer.asked(*lookup) for lookup in lookups for observer in self.of_lookups]

        def tell(error: TransformException | None) -> None:
            with self.quiet():
                for end in ends:
                    if end is not None:
                        end(error)

        return tell

    def watch(self, lookups: Sequence[Asked], query: Callable[..., Answer],
              *arguments: Any) -> Answer:
        """Answer a query, and tell of it as these lookups."""
        end = self.begin(*lookups)
        try:
            with self.quiet():
                answer = query(*arguments)
        except TransformException as error:
            end(error)
            raise
        end(None)
        return answer

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Tell of no lookup that this thread makes meanwhile."""
        before = getattr(self._inside, 'is_told', False)
        self._inside.is_told = True
        try:
            yield
        finally:
            self._inside.is_told = before


def asked(target: str, source: str, stamp: int) -> Asked:
    """Return a lookup whose stamp may be ``LATEST``, as observers are told of it."""
    return target, source, None if stamp == LATEST else stamp


def halves(target: str, target_stamp: int, source: str, source_stamp: int,
           fixed: str) -> list[Asked]:
    """Return the two lookups that one between two times consists of."""
    return [asked(fixed, source, source_stamp), asked(target, fixed, target_stamp)]


def _nothing(_: TransformException | None) -> None:
    """Tell nobody."""


NOBODY = Observers()
"""The observers of a tree that nobody ever watches."""
