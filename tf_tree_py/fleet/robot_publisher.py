# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Publishes a robot's transforms over Zenoh for a ``FleetListener``, without ROS.

Simulated robots only send transforms: for demos, tests and benchmarks of a fleet.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
import threading
import time
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.closable import Closable
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write

from .keys import check_sender, key_of, token_of, Topic
from .session import end_soon, needs_zenoh, zenoh_call

if TYPE_CHECKING:
    import zenoh

# How often a publisher sends the number of its last message, so that losses are detected. Zenoh's
# sporadic heartbeat would wait for a router that hangs, and Zenoh would hold Python's lock, and so
# stop the whole process, while a publisher is undeclared meanwhile.
HEARTBEAT_S = 1.0
DEFAULT_HISTORY = 200
"""The number of messages of moving frames that are kept: 10 s at 20 Hz."""


class RobotPublisher(Closable):
    """
    Sends a robot's transforms, and declares it present as long as it is open.

    Moving transforms may be lost on a slow link; receivers request lost ones again as long as they
    are kept, except for the first ones, sent before the robot knew of the receiver. So an outage
    of the router loses nothing if the kept messages last for the outage and 1.5 s more, which
    reconnecting may take: 200 messages at 20 Hz survive 8.5 s, 2,000 at 100 Hz survive 18.5 s.
    Each kept message takes its bytes and half a kilobyte more.

    Static transforms wait until they are sent. Only their last message is kept, so each has to
    hold all of the robot's static transforms. It may be used from any thread, and is a context
    manager.
    """

    def __init__(self, session: 'zenoh.Session', robot: str, *, key_prefix: str = '',
                 history: int = DEFAULT_HISTORY) -> None:
        """
        Declare a robot present.

        :param session: an open session of Zenoh, which stays open: see ``open_session``.
        :param robot: its name, as a part of keys.
        :param key_prefix: precedes it in keys.
        :param history: the number of moving messages that are kept for late joiners, and for all
            after an outage.
        :raises FleetError: the name is not allowed in keys.
        """
        self.robot, prefix = check_sender(robot, key_prefix)
        zenoh = needs_zenoh()
        with zenoh_call():
            self._moving = _Sender(session, key_of(Topic(self.robot, False), prefix), history,
                                   zenoh.CongestionControl.DROP)
            self._static = _Sender(session, key_of(Topic(self.robot, True), prefix), 1,
                                   zenoh.CongestionControl.BLOCK)
            # Last, so that a listener that sees the token can already receive the robot.
            token = session.liveliness().declare_token(token_of(self.robot, prefix))
        self._undeclare: list[Callable[[], object]] = [
            token.undeclare, self._static.undeclare, self._moving.undeclare]

    def send(self, data: bytes) -> None:
        """Send moving transforms: a TFMessage as ``core.messages.wire`` writes it."""
        self._moving.send(data)

    def send_static(self, data: bytes) -> None:
        """Send all of the robot's static transforms, as one TFMessage."""
        self._static.send(data)

    def close(self) -> None:
        """
        Declare the robot gone; its stored messages are dropped.

        This takes two seconds at most: if the router hangs, the rest happens in the background.
        """
        undeclare, self._undeclare = self._undeclare, []
        end_soon(*undeclare)


class _Sender:
    """A publisher that keeps its last messages, to send lost ones again; for any thread."""

    def __init__(self, session: 'zenoh.Session', key: str, history: int,
                 congestion: 'zenoh.CongestionControl') -> None:
        """Declare it."""
        zenoh, ext = needs_zenoh(), needs_zenoh('zenoh.ext')
        self._publisher = ext.declare_advanced_publisher(
            session, key, congestion_control=congestion, reliability=zenoh.Reliability.RELIABLE,
            cache=ext.CacheConfig(max_samples=history), publisher_detection=True,
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=HEARTBEAT_S, sporadic_heartbeat=None))
        # Zenoh raises an error if a publisher is undeclared while another thread sends with it.
        self._lock = threading.Lock()

    def send(self, data: bytes) -> None:
        """Send a message."""
        with zenoh_call(), self._lock:
            self._publisher.put(data)

    def undeclare(self) -> None:
        """Undeclare it, as soon as nothing is being sent."""
        with self._lock:
            self._publisher.undeclare()


# --- simulated robots

class SimulatedRobot(NamedTuple):
    """
    A robot and its motion.

    :ivar name: as a part of keys.
    :ivar static: its static transforms.
    :ivar moving: returns its moving transforms at a stamp in nanoseconds.
    """

    name: str
    static: Sequence[Sample]
    moving: Callable[[int], Sequence[Sample]]


def drive(session: 'zenoh.Session', robots: Sequence[SimulatedRobot], rate_hz: float,
          ended: threading.Event, key_prefix: str = '') -> int:
    """
    Send the robots' current transforms, each at its own part of the period, until ``ended``.

    :param rate_hz: the number of messages per second of each robot.
    :return: the number of moving messages that were sent.
    """
    with ExitStack() as closing:
        publishers = [closing.enter_context(
            RobotPublisher(session, robot.name, key_prefix=key_prefix)) for robot in robots]
        for robot, publisher in zip(robots, publishers, strict=True):
            publisher.send_static(write(robot.static))
        begin, sent = time.monotonic(), 0
        while not ended.wait(max(0.0, begin + sent / (rate_hz * len(robots)) - time.monotonic())):
            which = sent % len(robots)
            publishers[which].send(write(robots[which].moving(time.time_ns())))
            sent += 1
        return sent
