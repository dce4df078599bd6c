# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Simulated robots that only send transforms: for demos, tests and benchmarks of a fleet."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
import threading
import time
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write

from .robot_publisher import RobotPublisher

if TYPE_CHECKING:
    import zenoh


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
