# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Looks up the pose of the gripper in the world periodically, and prints it."""

from collections.abc import Iterable, Sequence
import sys
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.task import Future
from tf_tree_py.command.arguments import Parser
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.stamp import format_stamp, from_seconds
from tf_tree_py.reports.explanation import what_is_missing
from tf_tree_py.reports.plain_text import as_line
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import as_pose
from tf_tree_py.ros.topics.listener import TransformListener

from .bad_input import frame_name
from .five_frame_motion import Frames
from .parameters import declare, describe, FRAME_PREFIX, Setting
from .running import ClosingNode, run, spin

NAME = 'five_frame_listener'

_DESCRIPTION = """\
Prints the pose of one frame in another: by default, the gripper in the world.

Each line is a lookup of the current time, so it waits until every edge on the path has data
for that time. The age is the time that it waited. You may start this before or after the
publisher.
Press Ctrl-C to stop."""
_EXAMPLES = (
    ('five_frame_listener', 'the gripper in the world'),
    ('five_frame_listener --ros-args -p target_frame:=odom -p source_frame:=camera',
     'another pair of frames'),
)

ASKING = (
    Setting('rate_hz', 2.0, 'how often to look up the pose, Hz', (0.01, 100.0)),
    Setting('timeout_s', 0.5, 'how long to wait for an answer, seconds', (0.0, 60.0)),
)
SETTINGS = (
    Setting('target_frame', Frames().world, 'the frame to express the pose in'),
    Setting('source_frame', Frames().gripper, 'the frame whose pose is printed'),
    *ASKING,
    FRAME_PREFIX,
)

_WALL_GUARD = Duration(seconds=10)


def say(line: str) -> None:
    """Write a line immediately, also into a pipe."""
    print(line, flush=True)


class FiveFrameListener(ClosingNode):
    """
    Looks up the current pose of the source frame on a timer, and prints it.

    If data is missing, it reports that once, and then prints nothing until there is an answer.

    :ivar buffer: the received transforms.
    :ivar asked: the number of lookups.
    :ivar answered: the number of lookups with an answer.
    """

    def __init__(self, others: Iterable[Setting] = (), **node_options: Any) -> None:
        """
        Start to receive and to look up.

        :param others: parameters of other nodes in this process.
        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid.
        """
        super().__init__(NAME, **node_options)
        values = declare(self, SETTINGS, others)
        prefix = values[FRAME_PREFIX.name]
        self.target_frame, self.source_frame = (
            frame_name(f'parameter {name}', prefix + values[name])
            for name in ('target_frame', 'source_frame'))
        self._timeout = Duration(nanoseconds=from_seconds(values['timeout_s']))
        # If simulated time stops, the wall clock ends the wait.
        self.buffer = Buffer(node=self, wall_guard=_WALL_GUARD)
        self._closing.callback(TransformListener(self.buffer, self).close)
        self.asked = self.answered = 0
        self._silent = False
        # A steady clock always runs, so the node can report that simulated time does not.
        self._ticks = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / values['rate_hz'], self._ask, clock=self._ticks)

    def give_up(self, _: object = None) -> None:
        """End the wait without a message; thread-safe."""
        self._silent = True
        self.buffer.waiting.fail(TransformException('given up'))

    def _ask(self) -> None:
        self.asked += 1
        stamp = self.get_clock().now()
        # A node's simulated time does not advance during its callbacks.
        begin = time.monotonic_ns()
        if stamp.nanoseconds == LATEST:
            self._not_answered('simulated time: nothing has been received on /clock yet')
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
        Print the pose of the source frame.

        :param stamp: of the pose, nanoseconds.
        :param pose: ``target_T_source``.
        :param age: its current age, nanoseconds of wall time.
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
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES, epilog=describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, _work)


def _work(ended: Future) -> None:
    node = FiveFrameListener()
    say(f'The pose of {node.source_frame} in {node.target_frame}, one lookup for each line:')
    ended.add_done_callback(node.give_up)
    spin(node, ended)


if __name__ == '__main__':
    sys.exit(main())
