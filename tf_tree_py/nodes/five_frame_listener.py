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

"""Asks again and again where the gripper is in the world, and prints the answers."""

from collections.abc import Iterable, Sequence
import sys
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.stamp import format_stamp, from_seconds
from tf_tree_py.core.telling.missing import what_is_missing
from tf_tree_py.core.telling.poses import as_line
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import as_pose
from tf_tree_py.ros.topics.listener import TransformListener

from .bad_input import frame_name
from .five_frame_motion import Frames
from .parameters import declare, describe, FRAME_PREFIX, Setting
from .running import Parser, run, spin

NAME = 'five_frame_listener'

_DESCRIPTION = """\
Prints where one frame is in another, the gripper in the world unless told otherwise.

Each line answers the question "where is it now?". The lookup has the stamp of that
moment, so it waits until every edge on the way has data as new as that. The age is
how long the answer took. You may start this before the publisher or after it.
Ctrl-C ends."""

ASKING = (
    Setting('rate_hz', 2.0, 'how often to ask where it is', (0.01, 100.0)),
    Setting('timeout_s', 0.5, 'how long to wait for an answer, seconds', (0.0, 60.0)),
)
SETTINGS = (
    Setting('target_frame', Frames().world, 'in whose coordinates'),
    Setting('source_frame', Frames().gripper, 'the frame whose place is asked for'),
    *ASKING,
    FRAME_PREFIX,
)

_WALL_GUARD = Duration(seconds=10)


def say(line: str) -> None:
    """Write a line at once, into a pipe too."""
    print(line, flush=True)


class FiveFrameListener(Node):
    """
    Asks on a timer where the source frame is now, and prints the answers.

    It says once what is missing, and then nothing until there is an answer.

    :ivar buffer: what has arrived.
    :ivar asked: how often it has asked.
    :ivar answered: how often there was an answer.
    """

    def __init__(self, others: Iterable[Setting] = (), **node_options: Any) -> None:
        """
        Begin to listen and to ask.

        :param others: parameters of other nodes in this process.
        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter that cannot be.
        """
        super().__init__(NAME, **node_options)
        values = declare(self, SETTINGS, others)
        prefix = values[FRAME_PREFIX.name]
        self.target_frame, self.source_frame = (
            frame_name(f'parameter {name}', prefix + values[name])
            for name in ('target_frame', 'source_frame'))
        self._timeout = Duration(nanoseconds=from_seconds(values['timeout_s']))
        # If simulated time stands still, the wall clock ends the wait.
        self.buffer = Buffer(node=self, wall_guard=_WALL_GUARD)
        self._listener = TransformListener(self.buffer, self)
        self.asked = self.answered = 0
        self._silent = False
        # This clock always goes, so it can say that simulated time does not.
        self._ticks = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / values['rate_hz'], self._ask, clock=self._ticks)

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._listener.close()
        super().destroy_node()

    def give_up(self, _: object = None) -> None:
        """End the wait without a word. Any thread may call this."""
        self._silent = True
        self.buffer.waiting.fail(TransformException('given up'))

    def _ask(self) -> None:
        self.asked += 1
        stamp = self.get_clock().now()
        # Simulated time does not go on for a node while it is in a callback.
        begin = time.monotonic_ns()
        if stamp.nanoseconds == LATEST:
            self._not_answered('simulated time: nothing has come on /clock yet')
            return
        try:
            transform = self.buffer.lookup_transform(
                self.target_frame, self.source_frame, stamp, self._timeout)
        except TransformException as error:
            self._not_answered(what_is_missing(self.buffer, error))
        else:
            self.answered += 1
            self._silent = False
            self.answer(stamp.nanoseconds, as_pose(transform), time.monotonic_ns() - begin)

    def answer(self, stamp: int, pose: Pose, age: int) -> None:
        """
        Tell where the source frame is.

        :param stamp: when, nanoseconds.
        :param pose: ``target_T_source``.
        :param age: how old that is by now, nanoseconds of wall time.
        """
        say(f'{format_stamp(stamp)[:-6]}  {as_line(pose)}  age {age / 1e6:3.0f} ms')

    def _not_answered(self, missing: str) -> None:
        if self._silent:
            return
        self._silent = True
        what = 'no new data of' if self.answered else 'waiting for'
        say(f'{what} {self.target_frame} -> {self.source_frame}: {missing}')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, _work)


def _work(ended: Future) -> None:
    node = FiveFrameListener()
    say(f'Where {node.source_frame} is in {node.target_frame}, asked anew for each line:')
    ended.add_done_callback(node.give_up)
    spin(node, ended)


if __name__ == '__main__':
    sys.exit(main())
