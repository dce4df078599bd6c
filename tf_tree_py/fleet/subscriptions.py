# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A listener's subscriptions: tokens, moving and static transforms, and lost messages."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, TYPE_CHECKING

from .connection import WorkerThreads
from .keys import patterns, token_patterns
from .reception import sender_of
from .roster import Sender
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

OnToken = Callable[[str, bool], object]

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

    def subscribe_tokens(self, on_token: OnToken) -> None:
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
