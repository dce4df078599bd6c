"""A robot's transforms into Zenoh, also where the router comes late and goes now and then."""

from collections.abc import Collection
import threading
from typing import TYPE_CHECKING

from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write

from .keys import check_prefix, check_robot
from .link import Link, Logger
from .publishing import DEFAULT_HISTORY, RobotPublisher

if TYPE_CHECKING:
    import zenoh


class Uplink:
    """
    Sends what a robot hands out, as soon as and whenever there is a router.

    Before the router is there for the first time, the last static transforms are kept. After
    it went, what moves is kept too, as ``RobotPublisher`` does, and whoever listens gets it
    when it is back. May be used from any thread.
    """

    def __init__(self, config: 'zenoh.Config', robot: str, logger: Logger, *,
                 key_prefix: str = '', history: int = DEFAULT_HISTORY) -> None:
        """
        Begin to connect.

        :param config: see ``configuration``.
        :param robot: its name, as a part of keys.
        :param logger: gets a line whenever the router comes or goes.
        :param key_prefix: what stands in front of the robot in keys.
        :param history: how many messages of what moves are kept for whoever comes late.
        :raises FleetError: no key can have this name, or Zenoh is not installed.
        """
        self._robot, self._prefix = check_robot(robot), check_prefix(key_prefix)
        self._history = history
        self._publisher: RobotPublisher | None = None
        self._lock = threading.Lock()
        self._static = b''
        self._link = Link(config, self._opened, logger)

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
        self._link.close()

    def _opened(self, session: 'zenoh.Session') -> None:
        publisher = RobotPublisher(
            session, self._robot, key_prefix=self._prefix, history=self._history)
        with self._lock:
            if self._static:
                publisher.send_static(self._static)
            self._publisher = publisher
