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

"""What a listener declares in a session: who is there, what moves and what not, what was lost."""

from collections.abc import Callable, Sequence
from typing import Any, TYPE_CHECKING

from .feed import Feed, source_of
from .keys import old_cache_of, patterns, token_patterns
from .listening import Threads
from .roster import Source
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

OnToken = Callable[[str, bool], object]

# How long a publisher of an older rmw_zenoh may take to answer.
_ANSWER_S = 2.0


class Hearing:
    """Declarations in a session, which live until ``close()``; each has a thread of its own."""

    def __init__(self, session: 'zenoh.Session', threads: Threads, robots: Sequence[str],
                 key_prefix: str) -> None:
        """
        Begin with none.

        :param robots: as ``keys.check_robots`` returns them.
        """
        self._session = session
        self._threads = threads
        self._robots = robots
        self._key_prefix = key_prefix
        self._declared: list[Any] = []

    def hear_tokens(self, on_token: OnToken) -> None:
        """Hear of each liveliness token, by its key, that it is there (True) or has gone."""
        put, liveliness = needs_zenoh().SampleKind.PUT, self._session.liveliness()
        for key in self._keys(lambda robots: token_patterns(robots, self._key_prefix)):
            subscriber = liveliness.declare_subscriber(
                key, self._threads.channel(), history=True)
            self._declared.append(subscriber)
            self._threads.take_all(
                subscriber.handler,
                lambda sample: on_token(str(sample.key_expr), sample.kind == put), 'tokens')

    def hear_transforms(self, static: bool, max_age_s: float | None, new_feed: Callable[[], Feed],
                        on_miss: Callable[[Source, int], object]) -> None:
        """
        Hear messages, first those of the past that their publishers keep.

        :param max_age_s: how old those may be; None: of any age.
        :param on_miss: called with who sent messages that were lost, and how many.
        """
        ext, direct = needs_zenoh('zenoh.ext'), needs_zenoh().handlers.Callback
        history = ext.HistoryConfig(detect_late_publishers=True, max_age=max_age_s)
        recovery = ext.RecoveryConfig(heartbeat=True, periodic_queries=None)
        for key in self._keys(lambda robots: patterns(robots, static, self._key_prefix)):
            subscriber = ext.declare_advanced_subscriber(
                self._session, key, self._threads.channel(), history=history, recovery=recovery)
            # It is rare, and takes no time: so it needs no thread.
            misses = subscriber.sample_miss_listener(direct(
                lambda miss: on_miss(source_of(miss.source), miss.nb), indirect=False))
            self._declared += [misses, subscriber]
            self._threads.take_all(subscriber.handler, new_feed().take, key)

    def ask_old_cache(self, token: str, feed: Feed) -> None:
        """Ask a publisher of an older rmw_zenoh for what it has kept; others do not answer."""
        key = old_cache_of(token)
        if key is None:
            return
        # What is answered has the key that it was published under.
        replies = self._session.get(key, self._threads.channel(), timeout=_ANSWER_S,
                                    accept_replies=needs_zenoh().ReplyKeyExpr.ANY)
        self._threads.take_all((reply.ok for reply in replies if reply.ok), feed.take, 'answers')

    def close(self) -> None:
        """Undeclare all."""
        declared, self._declared = self._declared, []
        for one in declared:
            one.undeclare()

    def _keys(self, keys_of: Callable[[str], Any]) -> list[str]:
        return list(dict.fromkeys(key for robots in self._robots for key in keys_of(robots)))
