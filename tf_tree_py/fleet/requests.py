# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A listener's subscriptions, and its requests for messages that Zenoh does not fetch.

It subscribes to tokens, to moving and static transforms, and to reports of lost messages.

One thread sends all requests, by robot in turn, so that a robot with many delays only itself.

Zenoh itself requests messages that are missing between two others. If its request ends early,
because a router dies meanwhile, it gives these messages up, although the publisher still keeps
them. A ``Gap`` requests them again, until the publisher has answered.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
import math
import threading
import time
from typing import Any, Final, TYPE_CHECKING

from .connection import WorkerThreads
from .keys import old_cache_of, patterns, token_patterns
from .roster import Sender
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

# The time limit of a response.
ANSWER_S = 2.0
# The maximum number of requests of one robot in the queue; and about that of all robots together:
# among n robots, each may have an n-th of it, but at least one. The oldest ones are dropped.
MOST_OF_ONE, MOST_OF_ALL = 100, 10_000
# How often in a row a request is sent that is not answered; and the pause before it is sent again
# if no robot has received it. The token of a robot that returns may arrive before its
# declarations, without which it receives no request.
MOST_TRIES, PAUSE_S = 5, 1.0
# The maximum number of responses to one request in the queue; one publisher has few.
_ANSWERS = 16

Receive = Callable[[str, 'zenoh.Sample'], object]
"""Receives the robot of a request, and a sample of the response."""


class Request:
    """
    A request for all that a publisher keeps under a key, such as an older one of rmw_zenoh.

    :ivar tries: how often in a row it was sent and not answered.
    """

    def __init__(self, robot: str, key: str, receive: Receive) -> None:
        """``key`` is what Zenoh is asked for; a sample has the key that it was published under."""
        self.robot, self.tries = robot, 0
        self._key = key
        self._receive = receive

    @property
    def selector(self) -> str:
        """Return what Zenoh is asked for."""
        return self._key

    @property
    def ended(self) -> bool:
        """Return whether it need not be repeated."""
        return True

    def receive(self, sample: 'zenoh.Sample') -> None:
        """Receive a sample of the response."""
        self._receive(self.robot, sample)


class Gap(Request):
    """
    A request for messages that are missing, by their numbers.

    A publisher answers with what it still keeps, the oldest first, up to its newest message. So
    the answer is complete as soon as it has a message from behind the gap.
    """

    def __init__(self, robot: str, key: str, sender: Sender, numbers: range,
                 receive: Receive) -> None:
        """``key`` is that of the transforms; the numbers are those of the publisher."""
        super().__init__(robot, key, receive)
        self._sender = sender
        self._numbers = numbers

    @property
    def selector(self) -> str:
        """Return the request for the rest."""
        zid, publisher = self._sender
        return f'{self._key}/@adv/*/{zid}/{publisher}/**?_sn={self._numbers.start}..'

    @property
    def ended(self) -> bool:
        """Return whether the publisher has answered completely."""
        return not self._numbers

    def receive(self, sample: 'zenoh.Sample') -> None:
        """Receive a message; what lies before it is no longer kept."""
        info = sample.source_info
        if info is not None and info.source_sn >= self._numbers.start:
            fills = info.source_sn in self._numbers
            self._numbers = range(info.source_sn + 1, self._numbers.stop)
            if fills:
                super().receive(sample)


class Requests:
    """A queue of requests, and the thread's work; the other methods are thread-safe."""

    def __init__(self, session: 'zenoh.Session') -> None:
        """Begin with an empty queue."""
        self._session = session
        self._changed = threading.Condition()
        # The requests by robot and selector; the next robot is first.
        self._waiting: OrderedDict[str, dict[str, Request]] = OrderedDict()
        # The requests without a complete answer; they are sent again when the pause ends, or when
        # their robot returns.
        self._unanswered: dict[str, dict[str, Request]] = {}
        self._pause_ends = math.inf
        self._returns = 0
        self._closed = False

    def add(self, request: Request) -> None:
        """Queue a request."""
        with self._changed:
            _put(self._waiting, request)
            self._changed.notify()

    def ask_old_cache(self, robot: str, token: str, receive: Receive) -> None:
        """Queue a request to a publisher, by its token; tokens of other kinds are ignored."""
        key = old_cache_of(token)
        if key:
            self.add(Request(robot, key, receive))

    def repeat(self, robot: str) -> None:
        """Queue what a robot that has returned has not answered completely."""
        with self._changed:
            self._returns += 1
            for request in self._unanswered.pop(robot, {}).values():
                request.tries = 0
                _put(self._waiting, request)
            self._changed.notify()

    def _try_again(self) -> None:
        """Queue the requests that no robot has received, unless they were sent too often."""
        self._pause_ends = math.inf
        for robot, requests in list(self._unanswered.items()):
            for selector, request in list(requests.items()):
                if request.tries < MOST_TRIES:
                    _put(self._waiting, requests.pop(selector))
            if not requests:
                del self._unanswered[robot]

    def close(self) -> None:
        """End, once the current request is answered or has timed out."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def work(self) -> None:
        """Send one request after the other, until it is closed."""
        while (request := self._next()) is not None:
            before, selector, is_slow = self._returns, request.selector, False
            with suppress(needs_zenoh().ZError):  # the session was closed in the meantime
                is_slow = self._send(request)
            with self._changed:
                if not request.ended:
                    # An answer that was too long for its time limit is continued.
                    has_begun = request.selector != selector
                    request.tries = 0 if has_begun else request.tries + 1
                    again = (has_begun or self._returns > before
                             or is_slow and request.tries < MOST_TRIES)
                    _put(self._waiting if again else self._unanswered, request)
                    if not again and request.tries < MOST_TRIES:
                        self._pause_ends = min(self._pause_ends, time.monotonic() + PAUSE_S)

    def _next(self) -> Request | None:
        with self._changed:
            while not self._closed:
                rest = self._pause_ends - time.monotonic()
                if rest <= 0.0:
                    self._try_again()
                elif self._waiting:
                    break
                else:
                    self._changed.wait(rest if rest < math.inf else None)
            if self._closed:
                return None
            robot, requests = self._waiting.popitem(last=False)
            request = requests.pop(next(iter(requests)))
            if requests:
                self._waiting[robot] = requests
            return request

    def _send(self, request: Request) -> bool:
        """Send a request, and take the answer; return whether there is a robot that was slow."""
        zenoh = needs_zenoh()
        replies = self._session.get(
            request.selector, zenoh.handlers.FifoChannel(_ANSWERS), timeout=ANSWER_S,
            accept_replies=zenoh.ReplyKeyExpr.ANY, consolidation=zenoh.ConsolidationMode.NONE)
        is_slow = False
        for reply in replies:
            if reply.ok is None:
                is_slow = True
            elif not self._closed:
                request.receive(reply.ok)
        return is_slow


def _put(requests: dict[str, dict[str, Request]], request: Request) -> None:
    of_robot = requests.setdefault(request.robot, {})
    of_robot[request.selector] = request
    if len(of_robot) > max(1, min(MOST_OF_ONE, MOST_OF_ALL // len(requests))):
        del of_robot[next(iter(of_robot))]


# --- subscriptions

_OnToken = Callable[[str, bool], object]

# Requests for past messages while a subscription is declared: the first one, and one for each
# publisher that is detected meanwhile.
_MOST_REQUESTS: Final = 10_000


class Subscriptions:
    """Declarations in a session, which live as long as it; each has its own thread."""

    def __init__(self, session: 'zenoh.Session', threads: WorkerThreads, robots: Sequence[str],
                 key_prefix: str) -> None:
        """
        Begin with none.

        :param robots: as ``keys.check_robots`` returns them.
        """
        self._session = session
        self._threads = threads
        self._robots = robots
        self._key_prefix = key_prefix
        # A declaration without a reference ends.
        self._declared: list[object] = []

    def subscribe_tokens(self, on_token: _OnToken) -> None:
        """Call back with each liveliness token's key, and whether it appeared (True) or went."""
        put, liveliness = needs_zenoh().SampleKind.PUT, self._session.liveliness()
        for key in self._keys(lambda robots: token_patterns(robots, self._key_prefix)):
            subscriber = liveliness.declare_subscriber(
                key, self._threads.channel(), history=True)
            self._declared.append(subscriber)
            self._threads.receive_all(
                subscriber.handler,
                lambda sample: on_token(str(sample.key_expr), sample.kind == put), 'tokens')

    def subscribe_transforms(self, static: bool, max_age_s: float | None,
                             receive: Callable[['zenoh.Sample'], object],
                             on_miss: Callable[[Sender, int], object]) -> None:
        """
        Subscribe to messages, first to the past ones that their publishers keep.

        :param max_age_s: the maximum age of these; None: any.
        :param receive: receives each message.
        :param on_miss: called with the sender of lost messages, and their number.
        """
        ext, direct = needs_zenoh('zenoh.ext'), needs_zenoh().handlers.Callback
        history = ext.HistoryConfig(detect_late_publishers=True, max_age=max_age_s)
        recovery = ext.RecoveryConfig(heartbeat=True, periodic_queries=None)
        for key in self._keys(lambda robots: patterns(robots, static, self._key_prefix)):
            with _unfinished_requests(self._session, key):
                subscriber = ext.declare_advanced_subscriber(
                    self._session, key, self._threads.channel(), history=history,
                    recovery=recovery)
                try:
                    self._threads.receive_all(subscriber.handler, receive, key)
                except RuntimeError:  # no thread can start: the program ends
                    subscriber.undeclare()
                    raise
            # It is rare, and takes no time, so it needs no thread.
            misses = subscriber.sample_miss_listener(direct(
                lambda miss: on_miss(sender_of(miss.source), miss.nb), indirect=False))
            self._declared += [misses, subscriber]

    def _keys(self, keys_of: Callable[[str], Iterable[str]]) -> list[str]:
        return list(dict.fromkeys(key for robots in self._robots for key in keys_of(robots)))


@contextmanager
def _unfinished_requests(session: 'zenoh.Session', key: str) -> Iterator[None]:
    """
    Keep the requests for past messages of a subscription unfinished while it is declared.

    When the first one is finished, Zenoh puts all past messages into the channel of the
    subscription, and waits while it is full. If they have all arrived before the declaration
    returns, it would wait in there, for a thread that cannot be started yet. The end drops the
    requests; this delivers the messages, or waits until that is possible.
    """
    zenoh = needs_zenoh()
    # They also go to the session itself, and end when it drops them.
    queryable: Any = session.declare_queryable(
        f'{key}/@adv/**', zenoh.handlers.FifoChannel(_MOST_REQUESTS),
        allowed_origin=zenoh.Locality.SESSION_LOCAL)
    kept = queryable.handler
    try:
        yield
    finally:
        queryable.undeclare()
        for request in kept:
            request.drop()


def sender_of(publisher: 'zenoh.EntityGlobalId') -> Sender:
    """Return the sender that a publisher is."""
    return str(publisher.zid), publisher.eid
