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

"""A robot's transforms into Zenoh, also where the router comes late and goes now and then."""

import atexit
from collections.abc import Collection
import threading

from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write

from .keys import check_prefix, check_robot, key_of, Topic
from .link import Link
from .listening import Threads
from .publishing import DEFAULT_HISTORY, RobotPublisher
from .session import configuration, Connect, endpoints_of, needs_zenoh, PathLike


class Uplink:
    """
    Sends what a robot hands out, as soon as and whenever there is a router.

    It connects, and connects again, by itself. Before the router is there for the first time
    the last static transforms are kept; after it went, also what moves, as
    ``RobotPublisher`` does, and whoever listens gets it when it is back. May be used from any
    thread.

    :ivar robot: its name in keys.
    :ivar name: what it is connected to, for people.
    """

    def __init__(self, connect: Connect | None, robot: str, *, config: PathLike | None = None,
                 key_prefix: str = '', history: int = DEFAULT_HISTORY) -> None:
        """
        Begin to connect.

        :param connect: a router, such as ``tcp/hall:7447``, or several; None: as ``config`` says.
        :param robot: its name, as a part of keys.
        :param config: a configuration file of Zenoh: TLS, user and password, and all else.
        :param key_prefix: what stands in front of the robot in keys.
        :param history: how many messages of what moves are kept for whoever comes late.
        :raises FleetError: Zenoh is not installed, or an argument cannot be.
        """
        self.robot, self._prefix = check_robot(robot), check_prefix(key_prefix)
        made = configuration(connect, config)
        self.name = ', '.join(endpoints_of(made))
        self._history = history
        self._publisher: RobotPublisher | None = None
        self._lock = threading.Lock()
        self._static = b''
        self._closed = threading.Event()
        self._threads = Threads(needs_zenoh().handlers.FifoChannel)
        self._link = Link(made, self.name, self._threads, lambda connected: None)
        self._thread = threading.Thread(target=self._open, name='uplink', daemon=True)
        # Zenoh aborts the process where the interpreter ends under one of its calls.
        atexit.register(self.close)
        self._thread.start()

    def key(self, static: bool) -> str:
        """Return the key under which what is static, or what moves, goes."""
        return key_of(Topic(self.robot, static), self._prefix)

    def send(self, samples: Collection[Sample]) -> None:
        """Send what moves, as one message."""
        if self._publisher is not None:
            self._publisher.send(write(samples))

    def send_static(self, samples: Collection[Sample]) -> None:
        """Send all of the robot's static transforms, as one message."""
        with self._lock:
            self._static = write(samples)
            if self._publisher is not None:
                self._publisher.send_static(self._static)

    def close(self) -> None:
        """Say that the robot has gone, and disconnect; nothing may be sent any more."""
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
            if self._static:
                publisher.send_static(self._static)
            self._publisher = publisher
