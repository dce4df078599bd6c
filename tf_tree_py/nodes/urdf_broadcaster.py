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

"""A robot's description and its joint states as transforms."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import sys
import threading
from typing import Any

import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.ros.messages.convert import as_nanoseconds
from tf_tree_py.ros.threads.companion import companion
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    sensor_qos,
    static_broadcaster_qos,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)
from tf_tree_py.urdf import DescriptionError, Robot
from tf_tree_py.urdf.expanding import text_of

from .bad_input import BadInput
from .parameters import declare, describe, FRAME_PREFIX, Setting
from .robot_frames import RobotFrames
from .running import Parser, run, spin
from .watched_file import WatchedFile

NAME = 'urdf_broadcaster'

_DESCRIPTION = """\
Publishes where the links of a robot are: what is fixed once, on /tf_static, and what moves
on /tf, with every message on joint_states. What robot_state_publisher is given, this is
given too. Of a file, urdf_broadcaster --urdf arm.urdf, it notices when it is edited; a file
that ends in .xacro is expanded. Ctrl-C ends.

Joints that mimic others follow them. A planar joint's positions are called NAME/x, NAME/y
and NAME/theta in the joint states, a floating one's NAME/trans_x, ..., NAME/rot_w. What a
message does not name stays where it was."""

_DESCRIBED = 'robot_description'
SETTINGS = (
    Setting(_DESCRIBED, '', 'the robot, as URDF: the text, not its file', changeable=True),
    Setting('publish_frequency', 20.0, 'how often each joint goes out at most, by its stamps',
            (0.001, 1000.0), changeable=True),
    Setting('ignore_timestamp', False, 'send every joint state, whatever its stamp',
            changeable=True),
    replace(FRAME_PREFIX, changeable=True),
)
_BY_NAME = {setting.name: setting for setting in SETTINGS}
_LOOK_AT_FILE_S = 0.2
_NO_STAMP = ('joint states come without a stamp, and are taken for as new as their arrival: '
             'whoever publishes them should set header.stamp')


class UrdfBroadcaster(Node):
    """
    Publishes a robot's transforms.

    Joint states are heard by a thread of its own; parameters and the file by whoever spins
    the node.
    """

    def __init__(self, urdf: str | None = None, name: str = NAME, **node_options: Any) -> None:
        """
        Begin to publish.

        :param urdf: the file to read and to watch; None: the parameter has the description.
        :param name: the node's.
        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter or the description is wrong.
        """
        super().__init__(name, **node_options)
        self._file = None if urdf is None else WatchedFile(urdf)
        self._values = self._declared(urdf)
        self._next = self._values, self._robot_of(self._values)
        # So that no message of an earlier description comes behind one of a new one.
        self._lock = threading.Lock()
        self._tf = self.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())
        # Both are latched, as robot_state_publisher has them.
        self._tf_static = self.create_publisher(
            TFMessage, TF_STATIC_TOPIC, static_broadcaster_qos())
        self._text = self.create_publisher(String, _DESCRIBED, static_broadcaster_qos())
        self._frames: RobotFrames | None = None
        self._apply()
        self.add_on_set_parameters_callback(self._check)
        self.add_post_set_parameters_callback(self._apply)
        if self._file is not None:
            self.create_timer(_LOOK_AT_FILE_S, self._look_at_file,
                              clock=Clock(clock_type=ClockType.STEADY_TIME))
        home = companion(self, f'{name}_impl', with_clock=False)
        home.create_subscription(
            JointState, self.resolve_topic_name('joint_states'), self._hear, sensor_qos())
        self._receiver = Receiver(home, lambda: None)

    def _declared(self, urdf: str | None) -> dict[str, Any]:
        """Declare the parameters; the description is that of the file, if there is one."""
        if urdf is None:
            return declare(self, SETTINGS)
        text = _read(urdf)
        values = declare(self, (replace(_BY_NAME[_DESCRIBED], default=text),
                                *(each for each in SETTINGS if each.name != _DESCRIBED)))
        if values[_DESCRIBED] != text:
            raise BadInput(f'give either --urdf or the parameter {_DESCRIBED}, not both')
        return values

    def _robot_of(self, values: dict[str, Any]) -> Robot:
        if not values[_DESCRIBED].strip():
            raise BadInput(f'there is no robot: give --urdf FILE, or the parameter {_DESCRIBED} '
                           'with the text of a URDF')
        source = f'parameter {_DESCRIBED}' if self._file is None else str(self._file.path)
        try:
            return Robot.parse(values[_DESCRIBED], source)
        except DescriptionError as error:
            raise BadInput(str(error)) from error

    def _check(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Say whether parameters can be what somebody wants to set them to."""
        try:
            values = self._values | {
                parameter.name: _BY_NAME[parameter.name].check(parameter.value)
                for parameter in parameters if parameter.name in _BY_NAME}
            self._next = values, self._robot_of(values)
        except BadInput as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, _: Sequence[Parameter] = ()) -> None:
        """Go on with the parameters that were found to be good, and tell everybody at once."""
        if self._frames is not None and self._next[0] == self._values:
            return
        self._values, robot = self._next
        interval = round(NANOSECONDS_PER_SECOND / self._values['publish_frequency'])
        with self._lock:
            self._frames = RobotFrames(
                robot, self._values[FRAME_PREFIX.name],
                None if self._values['ignore_timestamp'] else interval,
                self.get_logger().warning, self._frames)
            self._text.publish(String(data=self._values[_DESCRIBED]))
            self._tf_static.publish(self._frames.fixed(self.get_clock().now().nanoseconds))
            known = self._frames.again()
            if known is not None:
                self._tf.publish(known)
        self.get_logger().info(str(robot))

    def _look_at_file(self) -> None:
        assert self._file is not None
        if not self._file.has_changed():
            return
        try:
            text = _read(self._file.path)
        except BadInput as error:
            self.get_logger().error(f'{error}. The robot stays as it was')
            return
        result, = self.set_parameters([Parameter(_DESCRIBED, value=text)])
        if not result.successful:
            self.get_logger().error(f'{result.reason}. The robot stays as it was')

    def _hear(self, message: JointState) -> None:
        stamp = as_nanoseconds(message.header.stamp)
        if not stamp:
            self.get_logger().warning(_NO_STAMP, once=True)
            stamp = self.get_clock().now().nanoseconds
        with self._lock:
            assert self._frames is not None
            data = self._frames.moved(stamp, tuple(message.name), np.asarray(message.position))
            if data is not None:
                self._tf.publish(data)

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._receiver.close()
        super().destroy_node()


def _read(path: str | Path) -> str:
    try:
        return text_of(path)
    except OSError as error:
        raise BadInput(f'{path} cannot be read: {error.strerror}') from error
    except DescriptionError as error:
        raise BadInput(str(error)) from error


def main(argv: Sequence[str] | None = None, name: str = NAME) -> int:
    """Run the executable under a name, also the node's; return its exit status."""
    parser = Parser(name, _DESCRIPTION, describe(SETTINGS))
    parser.add_argument('--urdf', metavar='FILE',
                        help='read the robot from a file, and notice when it is edited')
    arguments = parser.parse_args(parser.own_arguments(argv))
    return run(name, argv, lambda ended: spin(UrdfBroadcaster(arguments.urdf, name), ended))


if __name__ == '__main__':
    sys.exit(main())
