# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publishes the robot of five frames on /tf and /tf_static, like the drivers of a robot."""

from collections.abc import Callable, Iterable
import sys
from typing import Any

from rclpy.node import Node
from tf_tree_py.core import Pose
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster

from .bad_input import BadInput, frame_name
from .five_frame_motion import FiveFrameMotion, Frames
from .parameters import declare, FRAME_PREFIX, Setting, Values
from .running import main_of

NAME = 'five_frame_publisher'

_DESCRIPTION = """\
Publishes a robot of five frames: world -> odom -> base_link -> {camera, gripper}.

odom -> base_link drives a circle, base_link -> gripper is an arm that reaches out
and back, and world -> odom drifts slowly, as a localiser's correction does. These
three are published on /tf, each with the stamp at which it is true. base_link -> camera
is a calibration: it is published once, on /tf_static. Press Ctrl-C to stop."""
_EXAMPLES = (
    ('five_frame_publisher', '50 Hz'),
    ('five_frame_publisher --ros-args -p drive_rate_hz:=500 -p lap_time_s:=5', 'faster'),
)

_RATES = (0.1, 1000.0)

SETTINGS = (
    Setting('radius', 2.0, 'radius of the circle that the robot drives, metres', (0.01, 1000.0)),
    Setting('lap_time_s', 20.0, 'the time for one lap, seconds', (0.1, 86400.0)),
    Setting('drive_rate_hz', 50.0, 'how often odom -> base_link is sent, Hz', _RATES),
    Setting('arm_rate_hz', 50.0, 'how often base_link -> gripper is sent, Hz', _RATES),
    Setting('drift_rate_hz', 10.0, 'how often world -> odom is sent, Hz', _RATES),
    *(Setting(f'{role}_frame', name, f'the name of the frame {role}')
      for role, name in Frames()._asdict().items()),
    FRAME_PREFIX,
)


class FiveFramePublisher(Node):
    """
    Publishes the transforms of the five frames.

    :ivar frames: their names, including the prefix.
    :ivar motion: the true motion, which is published.
    """

    def __init__(self, others: Iterable[Setting] = (), **node_options: Any) -> None:
        """
        Start to publish.

        :param others: parameters of other nodes in this process.
        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid.
        """
        super().__init__(NAME, **node_options)
        values = declare(self, SETTINGS, others)
        self.frames = frames = _frames(values)
        self.motion = motion = FiveFrameMotion(values['radius'],
                                               from_seconds(values['lap_time_s']))
        self._broadcaster = TransformBroadcaster(self)
        self._static_broadcaster = StaticTransformBroadcaster(self)
        self._static_broadcaster.sendTransform(transform_stamped(
            frames.base_link, frames.camera, self._now(), motion.base_link_T_camera))
        # Each has its own timer: on a robot, three programs would send them.
        self._send_at(values['drift_rate_hz'], frames.world, frames.odom, motion.world_T_odom)
        self._send_at(values['drive_rate_hz'], frames.odom, frames.base_link,
                      motion.odom_T_base_link)
        self._send_at(values['arm_rate_hz'], frames.base_link, frames.gripper,
                      motion.base_link_T_gripper)

    def _now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _send_at(self, rate_hz: float, parent: str, child: str,
                 pose_at: Callable[[int], Pose]) -> None:
        def send() -> None:
            # The timer may be late. The pose is the pose at the stamp in any case.
            stamp = self._now()
            self._broadcaster.sendTransform(
                transform_stamped(parent, child, stamp, pose_at(stamp)))

        self.create_timer(1.0 / rate_hz, send)


def _frames(values: Values) -> Frames:
    prefix = values[FRAME_PREFIX.name]
    names = [frame_name(f'parameter {role}_frame', prefix + values[f'{role}_frame'])
             for role in Frames._fields]
    if len(set(names)) < len(names):
        raise BadInput(f'the five frames need five names, not {", ".join(names)}')
    return Frames(*names)


main = main_of(NAME, _DESCRIPTION, _EXAMPLES, SETTINGS, FiveFramePublisher)


if __name__ == '__main__':
    sys.exit(main())
