# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs the publisher and the listener of the five frames in one terminal."""

from collections.abc import Sequence
import math
import sys
import time

from rclpy.parameter import Parameter
from rclpy.task import Future
from tf_tree_py.command.arguments import Parser, positive_number
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.reports.plain_text import as_line

from .five_frame_listener import ASKING, FiveFrameListener, say
from .five_frame_publisher import FiveFramePublisher, SETTINGS as PUBLISHER_SETTINGS
from .parameters import describe
from .running import run, spin, spun_in_background

NAME = 'five_frame_demo'

_DESCRIPTION = """\
Shows a robot of five frames and where its gripper is, in one terminal.

A publisher sends the transforms over DDS, as five_frame_publisher does; a listener
receives them and looks up the gripper, as five_frame_listener does. The true motion
is known here, so every answer is compared with it. Press Ctrl-C to stop."""
_EXAMPLES = (
    ('five_frame_demo', 'until Ctrl-C'),
    ('five_frame_demo --seconds 5 --ros-args -p rate_hz:=10', 'ten lines a second, for 5 s'),
)

_INTRODUCTION = """\
Live over DDS: the pose of a moving robot's gripper in the world, at the time of each line.
age: the wait for the next sample of every edge (by default, the slowest is sent every 100 ms)
off: the distance of the answer from the true motion"""


class DemoListener(FiveFrameListener):
    """A listener that compares its answers with the true motion."""

    def __init__(self, publisher: FiveFramePublisher) -> None:
        """
        Start to receive and to look up.

        :param publisher: the publisher of the gripper.
        """
        # The publisher's frames may have other names.
        frames = publisher.frames
        names = {'target_frame': frames.world, 'source_frame': frames.gripper, 'frame_prefix': ''}
        super().__init__(PUBLISHER_SETTINGS, parameter_overrides=[
            Parameter(name, value=value) for name, value in names.items()])
        self._motion = publisher.motion
        self._begin = time.monotonic()
        self._all_ages = self._worst_age = 0
        self._worst_distance = self._worst_angle = 0.0

    def answer(self, stamp: int, pose: Pose, age: int) -> None:
        """Print the pose of the gripper, and its distance from the true pose."""
        distance, angle = se3.distance(self._motion.world_T_gripper(stamp), pose)
        self._all_ages += age
        self._worst_age = max(self._worst_age, age)
        self._worst_distance = max(self._worst_distance, distance)
        self._worst_angle = max(self._worst_angle, angle)
        say(f'{format_stamp(stamp)[:-6]}  {as_line(pose)}  age {age / 1e6:3.0f} ms  '
            f'off {distance * 1e3:.3f} mm')

    def summary(self) -> str:
        """Return the summary that is printed at the end."""
        counts = self.buffer.statistics()
        mean_age = self._all_ages / max(1, self.answered)
        return (
            f'{time.monotonic() - self._begin:.1f} s: {self.answered} of {self.asked} lookups '
            f'answered, {mean_age / 1e6:.0f} ms after the requested stamp on average, '
            f'{self._worst_age / 1e6:.0f} ms at most.\n'
            f'Furthest from the true motion: {self._worst_distance * 1e3:.3f} mm, '
            f'{math.degrees(self._worst_angle):.4f} deg. '
            f'{counts.accepted} transforms received, {counts.refused} refused.')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES,
                    epilog=describe((*PUBLISHER_SETTINGS, *ASKING)))
    parser.add_argument('--seconds', type=positive_number, metavar='N',
                        help='stop after this many seconds')
    arguments = parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: _demo(ended, arguments.seconds))


def _demo(ended: Future, seconds: float | None) -> None:
    say(_INTRODUCTION)
    publisher = FiveFramePublisher(ASKING)
    with spun_in_background(publisher):
        listener = DemoListener(publisher)
        ended.add_done_callback(listener.give_up)
        spin(listener, ended, seconds)
    say(listener.summary())


if __name__ == '__main__':
    sys.exit(main())
