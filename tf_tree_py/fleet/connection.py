# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The connection to a router: opened as soon as possible, monitored, and logged when lost.

Worker threads receive what Zenoh delivers. An ``Uplink`` sends a robot's transforms, also with a
router that is started late or restarted.
"""

import atexit
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
import logging
import threading
import time
from typing import Any, TYPE_CHECKING, TypeVar

from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.limited_log import FailureLog, IncidentLog, LimitedLog

from .keys import check_sender, key_of, Topic
from .robot_publisher import DEFAULT_HISTORY, RobotPublisher
from .session import (
    ATTEMPT_S,
    CLOSE_S,
    configuration,
    Connect,
    endpoints_of,
    FleetError,
    needs_zenoh,
    PathLike,
    try_session,
    why_no_session,
    zenoh_call,
)

if TYPE_CHECKING:
    import zenoh

log = logging.getLogger('tf_tree_py.fleet')
_One = TypeVar('_One')

# This many samples may wait for the thread that sorts them. Beyond that Zenoh waits, too, and the
# router of the sender drops messages.
WAITING = 200
# This many are taken at once: each wait releases the interpreter, and other threads may hold it
# for long.
_AT_ONCE = 100


class FleetLogs:
    """
    What is wrong with what arrives; clients can cause any number of lines.

    :ivar incidents: with transforms, in the log ``tf_tree_py.fleet.incidents``.
    :ivar warnings: with robots.
    :ivar failures: exceptions.
    """

    def __init__(self) -> None:
        self.incidents = IncidentLog(log.getChild('incidents'))
        self.warnings = LimitedLog(log.warning)
        self.failures = FailureLog(log.error)

    def write_counts(self) -> None:
        """Write the counts of ended floods; call this about once a second."""
        for each in (self.incidents, self.warnings, self.failures):
            each.write_counts()


class WorkerThreads:
    """
    Threads for the channels of Zenoh, one for each, and for other work.

    Zenoh would run callbacks in threads that cannot be joined. They abort the process if the
    interpreter ends first.
    """

    def __init__(self, failures: FailureLog) -> None:
        """
        Begin without threads.

        :param failures: the log of exceptions.
        """
        self._failures = failures
        self._threads: list[threading.Thread] = []

    def channel(self) -> Any:
        """Return a handler for a declaration, from which samples are taken."""
        return needs_zenoh().handlers.FifoChannel(WAITING)

    def receive_all(self, handler: 'zenoh.handlers.Handler[_One]',
                    receive: Callable[[_One], object], what: str) -> None:
        """Start a thread that receives samples until their declaration is undeclared."""
        self.start(lambda: self._receive_all(handler, receive), what)

    def start(self, work: Callable[[], object], what: str) -> None:
        """Start a thread for work that ends when everything is closed."""
        thread = threading.Thread(target=work, name=f'fleet {what}', daemon=True)
        thread.start()
        self._threads = [one for one in self._threads if one.is_alive()] + [thread]

    def join(self) -> None:
        """Wait for the threads to end; the session is closed."""
        for thread in self._threads:
            thread.join()

    def _receive_all(self, handler: 'zenoh.handlers.Handler[_One]',
                     receive: Callable[[_One], object]) -> None:
        for one in _in_turn(handler):
            try:
                receive(one)
            except Exception:  # noqa: B902 - the next may be valid
                self._failures.report('tf_tree_py.fleet, in a delivery,')


def _in_turn(handler: 'zenoh.handlers.Handler[_One]') -> Iterator[_One]:
    """Yield samples until their declaration is undeclared."""
    for first in handler:
        yield first
        with suppress(needs_zenoh().ZError):  # it was undeclared in the meantime
            for _ in range(_AT_ONCE):
                one = handler.try_recv()
                if one is None:
                    break
                yield one


# --- the connection

_PAUSE_S = 0.5


class Connection:
    """
    A session that is opened as soon as there is a router, and reconnects by itself.

    Each loss and each return is one line in the log ``tf_tree_py.fleet``, at most one a second.

    :ivar name: the routers, for people.
    :ivar threads: receive what is declared in the session.
    """

    def __init__(self, config: 'zenoh.Config', logs: FleetLogs,
                 on_change: Callable[[bool], object] = lambda connected: None) -> None:
        """
        Store the settings.

        :param config: see ``session.configuration``.
        :param on_change: called with whether there is a connection, when that changes.
        """
        self.name = ', '.join(endpoints_of(config))
        self.threads = WorkerThreads(logs.failures)
        self._limited = logs.warnings
        self._config = config
        self._on_change = on_change
        self._session: Any = None
        self._transports: set[str] = set()
        self._lost_at: float | None = None

    def await_session(self, closed: threading.Event) -> 'zenoh.Session | None':
        """Return a session as soon as there is a router; None: ``closed`` was set before that."""
        while not closed.is_set():
            try:
                session = try_session(self._config, ATTEMPT_S)
            except FleetError as error:
                if self._lost_at is None and not closed.is_set():
                    self._lost_at = time.monotonic()
                    log.warning('no connection to %s yet, retrying: %s', self.name,
                                self.why_not() or error)
                closed.wait(_PAUSE_S)
                continue
            self._session = session
            if closed.is_set():
                self.close()
                return None
            self._listener = session.info.declare_transport_events_listener(
                self.threads.channel(), history=True)
            # The listener itself cannot be undeclared while another thread receives from it.
            self.threads.receive_all(self._listener.handler, self._hear, 'link')
            return session
        return None

    def why_not(self) -> str:
        """Return why there is no connection, as far as this machine can find it, or ''."""
        return why_no_session(self._config)

    def close(self) -> None:
        """
        Close the session, if there is one, with all that is declared in it, and its threads.

        Its channels end at once, and their threads with them; the rest may take twenty seconds if
        the router hangs.
        """
        session, self._session = self._session, None
        if session is not None:
            # If the link hangs, the peer cannot be notified of the end.
            with suppress(needs_zenoh().ZError):
                session.close()
        self.threads.join()

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
            self._limited.write('connection lost', self.name, (
                f'the connection to {self.name} is lost: transforms that are sent until it is '
                'restored may be lost too'), None)
        elif self._lost_at is not None:
            self._limited.write('connected', self.name, (
                f'connected to {self.name}, after {now - self._lost_at:.1f} s without a '
                'connection'), None)
            self._lost_at = None
        self._on_change(connected)


# --- sending

class Uplink:
    """
    Sends a robot's transforms whenever there is a router.

    It connects and reconnects by itself. Before the first connection it keeps the last static
    transforms; after a lost connection it also keeps moving ones, as ``RobotPublisher`` does, and
    listeners receive them when it is back. It may be used from any thread.

    :ivar robot: its name in keys.
    :ivar name: the routers, for people.
    """

    def __init__(self, connect: Connect | None, robot: str, *, config: PathLike | None = None,
                 key_prefix: str = '', history: int = DEFAULT_HISTORY) -> None:
        """
        Begin to connect.

        :param connect: a router, such as ``tcp/hall:7447``, or several; None: those of ``config``.
        :param robot: its name, as a part of keys.
        :param config: a configuration file of Zenoh: TLS, user and password, and all other
            settings.
        :param key_prefix: precedes the robot in keys.
        :param history: the number of moving messages that are kept, see ``RobotPublisher``.
        :raises FleetError: Zenoh is not installed, or an argument is invalid.
        """
        self.robot, self._prefix = check_sender(robot, key_prefix)
        self._link = Connection(configuration(connect, config), FleetLogs())
        self.name = self._link.name
        self._history = history
        self._publisher: RobotPublisher | None = None
        self._lock = threading.Lock()
        self._static = b''
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name='uplink', daemon=True)
        # The end of the program only waits until its thread ends.
        atexit.register(self.close)
        self._thread.start()

    def key(self, static: bool) -> str:
        """Return the key of the static or the moving transforms."""
        return key_of(Topic(self.robot, static), self._prefix)

    def send(self, samples: Collection[Sample]) -> None:
        """Send moving transforms, as one message."""
        if self._publisher is not None:
            self._publisher.send(write(samples))

    def send_static(self, samples: Collection[Sample]) -> None:
        """Send all of the robot's static transforms, as one message."""
        with self._lock:
            self._static = write(samples)
            if self._publisher is not None:
                self._publisher.send_static(self._static)

    def close(self) -> None:
        """
        Declare the robot gone, and disconnect; nothing may be sent any more.

        This takes two seconds at most: if the router hangs, the rest happens in the background.
        """
        self._closed.set()
        self._thread.join(CLOSE_S)

    def _run(self) -> None:
        with zenoh_call():
            session = self._link.await_session(self._closed)
            if session is not None:
                self._begin(session)
                self._closed.wait()
                self._link.close()
        atexit.unregister(self.close)

    def _begin(self, session: 'zenoh.Session') -> None:
        publisher = RobotPublisher(
            session, self.robot, key_prefix=self._prefix, history=self._history)
        with self._lock:
            # First, because a slow link may block static transforms for seconds; moving ones that
            # are sent meanwhile would be dropped.
            self._publisher = publisher
            if self._static:
                publisher.send_static(self._static)
