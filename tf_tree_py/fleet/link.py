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

"""The connection to a router: made when it can be, watched, and told of when it is lost."""

from collections.abc import Callable
from contextlib import suppress
import threading
import time
from typing import Any, TYPE_CHECKING

from .errors import FleetError
from .listening import log, Threads
from .session import needs_zenoh, open_session

if TYPE_CHECKING:
    import zenoh

# How long an attempt may take: whoever closes waits for it; five times there and back have to
# fit, over the Internet too.
_ATTEMPT_S = 2.0
_PAUSE_S = 0.5


class Link:
    """
    A session that is opened as soon as there is a router, and reconnects by itself.

    Each loss and each return is one line in the log ``tf_tree_py.fleet``.
    """

    def __init__(self, config: 'zenoh.Config', name: str, threads: Threads,
                 on_change: Callable[[bool], object]) -> None:
        """
        Take what to connect to.

        :param config: see ``session.configuration``.
        :param name: of the router, for people.
        :param on_change: called with whether there is a connection, when that changes.
        """
        self._config = config
        self._name = name
        self._threads = threads
        self._on_change = on_change
        self._session: Any = None
        self._listener: Any = None
        self._transports: set[str] = set()
        self._lost_at: float | None = None

    def await_session(self, closed: threading.Event) -> 'zenoh.Session | None':
        """Return a session as soon as there is a router; None: it was closed before."""
        while not closed.is_set():
            try:
                session = open_session(self._config, _ATTEMPT_S)
            except FleetError as error:
                if self._lost_at is None:
                    self._lost_at = time.monotonic()
                    log.warning('no connection to %s yet, and tries go on: %s', self._name, error)
                closed.wait(_PAUSE_S)
                continue
            self._session = session
            self._listener = session.info.declare_transport_events_listener(
                self._threads.channel(), history=True)
            self._threads.take_all(self._listener, self._hear, 'link')
            return session
        return None

    def close(self) -> None:
        """Close the session, if there is one."""
        session, self._session = self._session, None
        if session is not None:
            self._listener.undeclare()
            # Where the link hangs, nobody can be told that this is the end.
            with suppress(needs_zenoh().ZError):
                session.close()

    def _hear(self, event: 'zenoh.TransportEvent') -> None:
        zid = str(event.transport.zid)
        if event.kind == needs_zenoh().SampleKind.PUT:
            self._transports.add(zid)
        else:
            self._transports.discard(zid)
        if self._session is not None:
            self._tell(bool(self._transports))

    def _tell(self, connected: bool) -> None:
        now = time.monotonic()
        if not connected:
            self._lost_at = now
            log.warning('the connection to %s is lost: what robots send until it is back may be '
                        'lost too', self._name)
        elif self._lost_at is not None:
            log.warning('connected to %s, after %.1f s without', self._name, now - self._lost_at)
            self._lost_at = None
        self._on_change(connected)
