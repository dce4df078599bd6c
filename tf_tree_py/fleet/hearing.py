"""What a listener declares in a session: who is there, what moves and what not, what was lost."""

from collections.abc import Callable, Sequence
from typing import Any, TYPE_CHECKING

from .feed import Feed, source_of
from .keys import old_cache_of, patterns, token_patterns
from .roster import Source
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

OnToken = Callable[[str, bool], object]


class Hearing:
    """Declarations in a session, which live until ``close()``; each has a thread of its own."""

    def __init__(self, session: 'zenoh.Session', robots: Sequence[str], key_prefix: str) -> None:
        """
        Begin with none.

        :param robots: as ``keys.check_robots`` returns them.
        """
        self._session = session
        self._robots = robots
        self._key_prefix = key_prefix
        self._declared: list[Any] = []

    def hear_tokens(self, on_token: OnToken) -> None:
        """Hear of each liveliness token, by its key, that it is there (True) or has gone."""
        put = needs_zenoh().SampleKind.PUT

        def hear(sample: 'zenoh.Sample') -> None:
            on_token(str(sample.key_expr), sample.kind == put)

        liveliness = self._session.liveliness()
        for key in dict.fromkeys(key for robots in self._robots
                                 for key in token_patterns(robots, self._key_prefix)):
            self._declared.append(liveliness.declare_subscriber(key, hear, history=True))

    def hear_transforms(self, static: bool, max_age_s: float | None, new_feed: Callable[[], Feed],
                        on_miss: Callable[[Source, int], object]) -> None:
        """
        Hear messages, first those of the past that their publishers keep.

        :param max_age_s: how old those may be; None: of any age.
        :param on_miss: called with who sent messages that were lost, and how many.
        """
        ext = needs_zenoh('zenoh.ext')
        delete = needs_zenoh().SampleKind.DELETE
        history = ext.HistoryConfig(detect_late_publishers=True, max_age=max_age_s)
        recovery = ext.RecoveryConfig(heartbeat=True, periodic_queries=None)

        def missed(miss: Any) -> None:
            on_miss(source_of(miss.source), miss.nb)

        for key in dict.fromkeys(key for robots in self._robots
                                 for key in patterns(robots, static, self._key_prefix)):
            take = new_feed().take
            subscriber = ext.declare_advanced_subscriber(
                self._session, key,
                lambda sample, take=take: None if sample.kind == delete else take(sample),
                history=history, recovery=recovery)
            self._declared += [subscriber.sample_miss_listener(missed), subscriber]

    def ask_old_cache(self, token: str, feed: Feed) -> None:
        """Ask a publisher of an older rmw_zenoh for what it has kept; others do not answer."""
        key = old_cache_of(token)
        if key is not None:
            def hear(reply: 'zenoh.Reply') -> None:
                if reply.ok is not None:
                    feed.take(reply.ok)

            # What is answered has the key that it was published under.
            self._session.get(key, hear, accept_replies=needs_zenoh().ReplyKeyExpr.ANY)

    def close(self) -> None:
        """Undeclare all."""
        declared, self._declared = self._declared, []
        for one in declared:
            one.undeclare()
