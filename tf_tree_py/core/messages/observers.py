# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Observers of a buffer: they are notified of arrivals, incidents and lookups.

Every tool that watches a buffer is an ``Observer``; nothing in the buffer needs to be replaced
or overridden. Without observers there is no cost. Subscriptions and recordings deliver the same
types of messages and endpoints, so an observer works with both.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import threading
from typing import NamedTuple, TypeVar

from .incidents import Incident
from .sample import Batch
from .. import fork_locks
from ..errors import no_truth, TransformException
from ..stamp import LATEST
from ..times import Stamps


class ReceivedMessage(NamedTuple):
    """
    Transforms that arrive, before any check: a message, or one that a program inserts.

    :ivar batch: its transforms, except those with an impossible stamp, which are incidents only.
    :ivar received: its time of arrival, nanoseconds, by the clock of its stamps; 0: that
        clock had not started, or the message was stored elsewhere before it was delivered.
    :ivar topic: the topic that it arrived on; '' if a program inserted it directly.
    :ivar static: whether its transforms are valid at all times.
    :ivar authority: its sender, or all possible senders; '' if unknown.
    """

    batch: Batch
    received: int
    topic: str
    static: bool = False
    authority: str = ''


class Endpoint(NamedTuple):
    """
    A publisher of a topic of transforms, or a subscription to it, and its quality of service.

    :ivar topic: of transforms.
    :ivar static: whether they are valid at all times.
    :ivar node: the full name of its node; '' if unknown.
    :ivar publishes: whether it is a publisher; otherwise it is a subscription.
    :ivar reliable: a reliable subscription does not match a best-effort publisher.
    :ivar transient_local: whether late subscribers receive earlier messages; a transient-local
        subscription does not match a volatile publisher.
    """

    topic: str
    static: bool
    node: str
    publishes: bool
    reliable: bool
    transient_local: bool


# --- observers

Answer = TypeVar('Answer')

AUDIT_FOLDER = 'TF_TREE_PY_AUDIT'
"""The environment variable that makes an audit observe every buffer; see ``tf_audit``."""

# Target frame, source frame, stamp (None: the latest) of a lookup.
Asked = tuple[str, str, int | None]
End = Callable[[TransformException | None], None]


class Observer:
    """
    An observer of a buffer; a subclass overrides the methods for the events that it needs.

    Each method is called in the thread in which the event happens, possibly by several
    threads at once. The methods must be fast, must not block, and must not raise.
    """

    def received(self, arrival: ReceivedMessage) -> None:
        """
        Receive transforms, moving or static, that are about to be inserted or refused.

        These are a whole message of a listener or a recording, or one transform that a program
        inserts directly, which has no topic. Of an edge with several sources, only the
        transforms of the active source are reported, and then the buffer's lock is held.
        """

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Receive incidents with their reasons; the buffer's lock is held."""

    def asked(self, target: str, source: str, stamp: int | None) -> End | None:
        """
        Receive a lookup that begins, in the caller's thread, with the caller on the stack.

        A lookup that waits, or is a future, is one lookup, no matter how often it is retried.
        A lookup between two times is reported as its two halves, and a lookup at many stamps
        with the newest of them.

        :param target: the requested target; it need not be the name of a frame.
        :param source: the requested source; it need not be the name of a frame either.
        :param stamp: nanoseconds; None: the latest.
        :return: a function that is called when the lookup has ended, with the error or None,
            in any thread. Lookups within this function are not reported. None: no call.
        """


class Observers:
    """
    All observers of one buffer, sorted by the events that they need.

    :ivar of_messages: observers of arrivals.
    :ivar of_incidents: observers of incidents.
    :ivar of_lookups: observers of lookups.
    """

    def __init__(self) -> None:
        self._lock = fork_locks.lock()
        self._all: tuple[Observer, ...] = ()
        # For each thread: whether it is inside a lookup that was already reported.
        self._inside = threading.local()
        self._sort()

    def __len__(self) -> int:
        return len(self._all)

    __bool__ = no_truth

    def add(self, observer: Observer) -> None:
        """Notify an observer from now on."""
        with self._lock:
            self._all += (observer,)
            self._sort()

    def remove(self, observer: Observer) -> None:
        """Stop notifying an observer; do nothing if it is not in the list."""
        with self._lock:
            self._all = tuple(other for other in self._all if other is not observer)
            self._sort()

    def _sort(self) -> None:
        self.of_messages = self._overriding('received')
        self.of_incidents = self._overriding('saw_incidents')
        self.of_lookups = self._overriding('asked')

    def _overriding(self, method: str) -> tuple[Observer, ...]:
        return tuple(observer for observer in self._all
                     if getattr(type(observer), method) is not getattr(Observer, method))

    # --- notifying them

    def notify_received(self, arrival: ReceivedMessage) -> None:
        """Notify of transforms that are about to be inserted or refused."""
        if arrival.batch.impossible:
            arrival = arrival._replace(batch=arrival.batch._replace(impossible=()))
        for observer in self.of_messages:
            observer.received(arrival)

    def notify_incidents(self, incidents: Sequence[Incident]) -> None:
        """Notify of incidents."""
        for observer in self.of_incidents:
            observer.saw_incidents(incidents)

    def watches_lookups(self) -> bool:
        """Return whether to report a lookup: there are observers, and it is the outermost."""
        return bool(self.of_lookups) and not getattr(self._inside, 'is_observed', False)

    def begin(self, *lookups: Asked) -> End:
        """Report lookups that begin; return the function to call when they have ended."""
        if not self.watches_lookups():
            return _nothing
        ends = [observer.asked(*lookup) for lookup in lookups for observer in self.of_lookups]

        def report_end(error: TransformException | None) -> None:
            with self.quiet():
                for end in ends:
                    if end is not None:
                        end(error)

        return report_end

    def watch(self, lookups: Sequence[Asked], query: Callable[..., Answer],
              *arguments: object) -> Answer:
        """Run a query, and return its answer; if it is the outermost, report it as lookups."""
        if not self.watches_lookups():
            return query(*arguments)
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
        """Report no lookups of this thread within the context."""
        before = getattr(self._inside, 'is_observed', False)
        self._inside.is_observed = True
        try:
            yield
        finally:
            self._inside.is_observed = before


def asked(target: str, source: str, stamp: int) -> Asked:
    """Return a lookup, whose stamp may be ``LATEST``, in the form that observers receive."""
    return target, source, None if stamp == LATEST else stamp


def newest_of(target: str, source: str, stamps: Stamps) -> list[Asked]:
    """Return the newest of lookups at many stamps; none, if there are no stamps."""
    return [(target, source, int(stamps.max()))] if len(stamps) else []


def halves(target: str, target_stamp: int, source: str, source_stamp: int,
           fixed: str) -> list[Asked]:
    """Return the two halves of a lookup between two times."""
    return [asked(fixed, source, source_stamp), asked(target, fixed, target_stamp)]


def _nothing(_: TransformException | None) -> None:
    """Do nothing at the end of a lookup that was not reported."""


NO_OBSERVERS = Observers()
"""The empty list of observers of a tree that has none."""
