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

"""Robots that are nothing but what they send: for demos, tests and benchmarks of a fleet."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
import threading
import time
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write

from .publishing import RobotPublisher

if TYPE_CHECKING:
    import zenoh


class SimulatedRobot(NamedTuple):
    """
    A robot and how it moves.

    :ivar name: as a part of keys.
    :ivar static: what does not move.
    :ivar moving: returns what moves, at a stamp in nanoseconds.
    """

    name: str
    static: Sequence[Sample]
    moving: Callable[[int], Sequence[Sample]]


def drive(session: 'zenoh.Session', robots: Sequence[SimulatedRobot], rate_hz: float,
          ended: threading.Event, key_prefix: str = '') -> int:
    """
    Let robots send what they do now, each in its own part of the period; until told to end.

    :param rate_hz: how often each of them sends.
    :return: how many messages of what moves went out.
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
