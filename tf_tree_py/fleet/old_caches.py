# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Requests stored messages from publishers of older releases of rmw_zenoh.

One thread sends all requests, by robot in turn, so that a robot with many tokens delays only
itself.
"""

from collections import OrderedDict
from collections.abc import Callable
import threading
from typing import Any, TYPE_CHECKING

from .keys import old_cache_of
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

Take = Callable[[str, Any], object]

# The time limit of a response.
_ANSWER_S = 2.0
# The maximum number of publishers of one robot in the queue.
_MOST_OF_ONE = 100
# The maximum number of responses to one request in the queue; one publisher has few.
_ANSWERS = 16


class OldCaches:
    """A queue of tokens, and the thread's work; the other methods are thread-safe."""

    def __init__(self, session: 'zenoh.Session', take: Take) -> None:
        """
        Begin with an empty queue.

        :param take: receives the robot of the request, and each sample of the response.
        """
        self._session = session
        self._take = take
        self._changed = threading.Condition()
        # The keys of the caches, by robot; the next robot is first.
        self._waiting: OrderedDict[str, dict[str, None]] = OrderedDict()
        self._closed = False

    def ask(self, robot: str, token: str) -> None:
        """Queue a request to a publisher, by its token; tokens of other kinds are ignored."""
        key = old_cache_of(token)
        with self._changed:
            keys = self._waiting.setdefault(robot, {}) if key else {}
            if key and len(keys) < _MOST_OF_ONE:
                keys[key] = None
                self._changed.notify()

    def close(self) -> None:
        """End, once the current request is answered or has timed out."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def work(self) -> None:
        """Send one request after the other, until it is closed."""
        while (question := self._next()) is not None:
            self._ask(*question)

    def _next(self) -> tuple[str, str] | None:
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._waiting)
            if self._closed:
                return None
            robot, keys = self._waiting.popitem(last=False)
            key = next(iter(keys))
            del keys[key]
            if keys:
                self._waiting[robot] = keys
            return robot, key

    def _ask(self, robot: str, key: str) -> None:
        zenoh = needs_zenoh()
        try:
            # The response has the key that it was published under.
            replies = self._session.get(key, zenoh.handlers.FifoChannel(_ANSWERS),
                                        timeout=_ANSWER_S,
                                        accept_replies=zenoh.ReplyKeyExpr.ANY)
            for reply in replies:
                if reply.ok and not self._closed:
                    self._take(robot, reply.ok)
        except zenoh.ZError:  # the session was closed in the meantime
            self.close()
