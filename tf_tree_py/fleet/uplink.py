# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sends a robot's transforms over Zenoh, also with a router that is started late or restarted."""

import atexit
from collections.abc import Collection
import threading

from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write

from .connection import Connection
from .keys import check_sender, key_of, Topic
from .robot_publisher import DEFAULT_HISTORY, RobotPublisher
from .session import configuration, Connect, endpoints_of, needs_zenoh, PathLike
from .worker_threads import WorkerThreads


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
        :param history: the number of moving messages that are kept for late joiners.
        :raises FleetError: Zenoh is not installed, or an argument is invalid.
        """
        self.robot, self._prefix = check_sender(robot, key_prefix)
        made = configuration(connect, config)
        self.name = ', '.join(endpoints_of(made))
        self._history = history
        self._publisher: RobotPublisher | None = None
        self._lock = threading.Lock()
        self._static = b''
        self._closed = threading.Event()
        self._threads = WorkerThreads(needs_zenoh().handlers.FifoChannel)
        self._link = Connection(made, self.name, self._threads, lambda connected: None)
        self._thread = threading.Thread(target=self._open, name='uplink', daemon=True)
        # Zenoh aborts the process if the interpreter ends during one of its calls.
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
        """Declare the robot gone, and disconnect; nothing may be sent any more."""
        self._closed.set()
        self._thread.join()
        self._link.close()
        self._threads.join()
        atexit.unregister(self.close)

    def _open(self) -> None:
        session = self._link.await_session(self._closed)
        if session is None:
            return
        publisher = RobotPublisher(
            session, self.robot, key_prefix=self._prefix, history=self._history)
        with self._lock:
            # First, because a slow link may block static transforms for seconds; moving ones that
            # are sent meanwhile would be dropped.
            self._publisher = publisher
            if self._static:
                publisher.send_static(self._static)
