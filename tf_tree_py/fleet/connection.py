# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The connection to a router: opened as soon as possible, monitored, and logged when lost."""

from collections.abc import Callable
from contextlib import suppress
import threading
import time
from typing import Any, TYPE_CHECKING

from .errors import FleetError
from .session import needs_zenoh, try_session, why_no_session
from .worker_threads import log, WorkerThreads

if TYPE_CHECKING:
    import zenoh

# The limit of an attempt, because ``close`` waits for it; five round trips have to fit, over the
# Internet, too.
_ATTEMPT_S = 2.0
_PAUSE_S = 0.5


class Connection:
    """
    A session that is opened as soon as there is a router, and reconnects by itself.

    Each loss and each return is one line in the log ``tf_tree_py.fleet``.
    """

    def __init__(self, config: 'zenoh.Config', name: str, threads: WorkerThreads,
                 on_change: Callable[[bool], object]) -> None:
        """
        Store the settings.

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
        """Return a session as soon as there is a router; None: it was closed before that."""
        while not closed.is_set():
            try:
                session = try_session(self._config, _ATTEMPT_S)
            except FleetError as error:
                if self._lost_at is None:
                    self._lost_at = time.monotonic()
                    log.warning('no connection to %s yet, retrying: %s', self._name,
                                self.why_not() or error)
                closed.wait(_PAUSE_S)
                continue
            self._session = session
            self._listener = session.info.declare_transport_events_listener(
                self._threads.channel(), history=True)
            # The listener itself cannot be undeclared while another thread receives from it.
            self._threads.take_all(self._listener.handler, self._hear, 'link')
            return session
        return None

    def why_not(self) -> str:
        """Return why there is no connection, as far as this machine can find it, or ''."""
        return why_no_session(self._config)

    def close(self) -> None:
        """Close the session, if there is one."""
        session, self._session = self._session, None
        if session is not None:
            self._listener.undeclare()
            # If the link hangs, the peer cannot be notified of the end.
            with suppress(needs_zenoh().ZError):
                session.close()

    def _hear(self, event: 'zenoh.TransportEvent') -> None:
        zid = str(event.transport.zid)
        if event.kind == needs_zenoh().SampleKind.PUT:
            self._transports.add(zid)
        else:
            self._transports.discard(zid)
        if self._session is not None:
            self._notify(bool(self._transports))

    def _notify(self, connected: bool) -> None:
        now = time.monotonic()
        if not connected:
            self._lost_at = now
            log.warning('the connection to %s is lost: transforms that are sent until it is '
                        'restored may be lost too', self._name)
        elif self._lost_at is not None:
            log.warning('connected to %s, after %.1f s without a connection', self._name,
                        now - self._lost_at)
            self._lost_at = None
        self._on_change(connected)
