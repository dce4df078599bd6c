# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Publishes a robot's transforms from its description and its joint states.

It detects edits of the file and of the files that it includes.
"""

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
import os
from pathlib import Path
import re
import sys
import threading
from typing import Any

import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf_tree_py.command.arguments import Parser
from tf_tree_py.command.endings import cannot_after
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.limited_log import LimitedLog
from tf_tree_py.ros.messages.convert import as_nanoseconds
from tf_tree_py.ros.threads.internal_node import internal_node
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    mismatches,
    sensor_qos,
    static_broadcaster_qos,
    tf_publisher,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)
from tf_tree_py.urdf import DescriptionError, Robot
from tf_tree_py.urdf.robot_xml import quoted
from tf_tree_py.urdf.xacro_files import description_of, DescriptionText

from .bad_input import BadInput
from .parameters import declare, describe, FRAME_PREFIX, given, Setting, Values
from .robot_frames import RobotFrames
from .running import ClosingNode, run, spin

_State = tuple[int, int, int]


class WatchedFiles:
    """
    Compares the times, sizes and inode numbers of files.

    Editors rewrite a file, replace it with another, or remove it for a moment. All of this is
    detected by polling, on any file system.

    :ivar path: the main file.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        """Record the current states of some files, of which the first is the main one."""
        self.path = files[0]
        self._known: dict[Path, _State | None] = {}
        self.watch(files)

    def watch(self, files: Iterable[Path]) -> None:
        """Watch these files from now on; recorded states are kept."""
        self._known = {file: self._known[file] if file in self._known else _look(file)
                       for file in files}

    def has_changed(self) -> bool:
        """Return whether a file has changed since the last call; False while one is absent."""
        now = {file: _look(file) for file in self._known}
        changed = {file: state for file, state in now.items()
                   if state not in (None, self._known[file])}
        self._known.update(changed)
        return bool(changed)


def _look(path: Path) -> _State | None:
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


# --- the node

NAME = 'urdf_broadcaster'

_DESCRIPTION = """\
Publishes the poses of a robot's links: fixed joints once, on /tf_static, and moving joints on
/tf, with every message on joint_states. It takes the same parameters as robot_state_publisher.
With a file, as in urdf_broadcaster --urdf arm.urdf, it reloads the robot when the file is
edited. A file that ends in .xacro is expanded, with arguments such as prefix:=left_, and the
files that it includes are watched too. Press Ctrl-C to stop.

Joints that mimic others follow them. The positions of a planar joint are called NAME/x,
NAME/y and NAME/theta in the joint states; those of a floating joint are called NAME/trans_x,
..., NAME/rot_w. Joints that a message does not name stay where they were."""
_EXAMPLES = (
    ('--urdf arm.urdf', 'from a file, read again when it is edited'),
    ('--urdf arm.xacro prefix:=left_', 'from xacro, with an argument'),
)

_DESCRIBED = 'robot_description'
SETTINGS = (
    Setting(_DESCRIBED, '', 'the robot as URDF: the text, not its file name', changeable=True),
    Setting('publish_frequency', 20.0, 'the highest rate of each joint, Hz of its stamps; 0: '
            'with every joint state', (0.0, 1000.0), changeable=True),
    Setting('ignore_timestamp', False, 'send every joint state, whatever its stamp',
            changeable=True),
    replace(FRAME_PREFIX, changeable=True),
)
_BY_NAME = {setting.name: setting for setting in SETTINGS}
_LOOK_AT_FILE_S = 0.2
# A description may have any number of faults.
_MOST_WARNINGS = 20
_ANYONE = 'set_parameters'
_NO_STAMP = ('joint states arrive without a stamp, so their time of arrival is used: '
             'their publisher should set header.stamp')


class UrdfBroadcaster(ClosingNode):
    """
    Publishes a robot's transforms.

    An internal thread receives joint states. Callbacks of parameters and of the file run in the
    thread that spins the node.
    """

    def __init__(self, urdf: str | None = None, name: str = NAME,
                 arguments: Mapping[str, str] | None = None, fallback: str | None = None,
                 **node_options: Any) -> None:
        """
        Start to publish.

        :param urdf: the file to read and to watch; None: the parameter has the description.
        :param name: of the node.
        :param arguments: of a file that ends in .xacro.
        :param fallback: the file to read and to watch if neither is given.
        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter or the description is invalid.
        """
        super().__init__(name, **node_options)
        self._arguments = arguments or {}
        # The positions of the elements of the description that was last read from files.
        self._read: DescriptionText | None = None
        if urdf is None and fallback is not None:
            urdf = self._without_option(fallback)
        self._values = self._declared(urdf)
        self._file = None if self._read is None else WatchedFiles(self._read.files)
        self._next = self._values, self._robot_of(self._values[_DESCRIBED])
        # Prevents a message of an earlier description from following one of a new description.
        self._lock = threading.Lock()
        self._tf = tf_publisher(self, TF_TOPIC, dynamic_qos(), static=False)
        # Both are latched, as in robot_state_publisher.
        self._tf_static = tf_publisher(
            self, TF_STATIC_TOPIC, static_broadcaster_qos(), static=True)
        self._text = self.create_publisher(String, _DESCRIBED, static_broadcaster_qos())
        self._frames: RobotFrames | None = None
        self._warnings = LimitedLog(self.get_logger().warning)
        # Whose parameters are being applied, for the log.
        self._setter = _ANYONE
        self._news = LimitedLog(lambda line: self.get_logger().info(line))
        self._apply()
        self.add_on_set_parameters_callback(self._check)
        self.add_post_set_parameters_callback(self._apply)
        if self._file is not None:
            self.create_timer(_LOOK_AT_FILE_S, self._look_at_file,
                              clock=Clock(clock_type=ClockType.STEADY_TIME))
        home = internal_node(self, f'{name}_impl', with_clock=False)
        self._topic = self.resolve_topic_name('joint_states')
        home.create_subscription(JointState, self._topic, self._hear, sensor_qos(),
                                 event_callbacks=mismatches(self._topic, self._warnings))
        self._closing.callback(Receiver(home, lambda: None, write_counts=self._write_counts).close)

    def _declared(self, urdf: str | None) -> Values:
        """Declare the parameters; the description is that of the file, if there is one."""
        if urdf is None:
            return declare(self, SETTINGS)
        self._read = _read(urdf, self._arguments)
        text = self._read.text
        values = declare(self, (replace(_BY_NAME[_DESCRIBED], default=text),
                                *(each for each in SETTINGS if each.name != _DESCRIBED)))
        if values[_DESCRIBED] != text:
            raise BadInput(f'give either --urdf or the parameter {_DESCRIBED}, not both')
        return values

    def _without_option(self, fallback: str) -> str | None:
        """Return the file given without --urdf, unless the parameter describes the robot."""
        if given(self, _BY_NAME[_DESCRIBED]).strip():
            self.get_logger().warning(f'{fallback!r} is ignored: the parameter {_DESCRIBED} '
                                      'describes the robot')
            return None
        self.get_logger().warning(f'{fallback!r} is used as the file of the robot, as '
                                  f'robot_state_publisher does; write --urdf {fallback}')
        return fallback

    def _robot_of(self, text: str) -> Robot:
        if not text.strip():
            raise BadInput(f'no robot is given: set --urdf FILE, or the parameter {_DESCRIBED} '
                           'with the text of a URDF')
        if '<' not in text:
            raise BadInput(
                f'parameter {_DESCRIBED} is {quoted(text)}, not the text of a URDF; if it is '
                'a file, give --urdf FILE, or its text: in a launch file, '
                "Command(['cat ', FILE]) or Command(['xacro ', FILE])")
        read = self._read if self._read is not None and self._read.text == text else None
        text_name = f'parameter {_DESCRIBED}' if read is None else str(read.files[0])
        with cannot_after(DescriptionError, ending=BadInput):
            return Robot.parse(text, text_name, None if read is None else read.places)

    def _check(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Check whether parameters can be set to new values."""
        try:
            values = self._values | {
                parameter.name: _BY_NAME[parameter.name].check(parameter.value)
                for parameter in parameters if parameter.name in _BY_NAME}
            self._next = values, self._robot_of(values[_DESCRIBED])
        except BadInput as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, _: Sequence[Parameter] = ()) -> None:
        """Apply checked parameters, and publish all transforms immediately."""
        if self._frames is not None and self._next[0] == self._values:
            return
        self._values, robot = self._next
        frequency = self._values['publish_frequency']
        interval = round(NANOSECONDS_PER_SECOND / frequency) if frequency else 0
        with self._lock:
            self._frames = RobotFrames(
                robot, self._values[FRAME_PREFIX.name],
                None if self._values['ignore_timestamp'] else interval,
                self._warn, self._frames)
            self._text.publish(String(data=self._values[_DESCRIBED]))
            self._tf_static.publish(self._frames.fixed(self.get_clock().now().nanoseconds))
            known = self._frames.again()
            if known is not None:
                self._tf.publish(known)
        # Anyone may set parameters, at any rate.
        if robot.warnings:
            more = len(robot.warnings) - _MOST_WARNINGS
            self._warnings.write('description', self._setter, [
                *robot.warnings[:_MOST_WARNINGS], *([f'and {more} more'] if more > 0 else [])],
                None)
        self._news.write('new parameters', self._setter, str(robot), None)

    def _look_at_file(self) -> None:
        assert self._file is not None
        if not self._file.has_changed():
            return
        try:
            self._read = _read(self._file.path, self._arguments)
        except BadInput as error:
            self.get_logger().error(f'{error}. The robot is unchanged')
            return
        self._file.watch(self._read.files)
        self._setter = str(self._file.path)
        try:
            result, = self.set_parameters([Parameter(_DESCRIBED, value=self._read.text)])
        finally:
            self._setter = _ANYONE
        if not result.successful:
            self.get_logger().error(f'{result.reason}. The robot is unchanged')

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

    def _warn(self, kind: str, sentence: str) -> None:
        self._warnings.write(kind, self._topic, sentence, sentence)

    def _write_counts(self) -> None:
        for log in (self._warnings, self._news):
            log.write_counts()


def _read(path: str | Path, arguments: Mapping[str, str]) -> DescriptionText:
    try:
        return description_of(path, arguments)
    except OSError as error:
        raise BadInput(f'{path} cannot be read: {error.strerror}') from error
    except DescriptionError as error:
        raise BadInput(str(error)) from error


def _split(argv: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """
    Return a command line without the arguments of a xacro, and those.

    In early ROS 2, an argument such as ``prefix:=left_`` was a remapping, and rcl still treats it
    as one, so it must not receive it. Remappings follow ``--ros-args``.
    """
    words = list(argv)
    end = words.index('--ros-args') if '--ros-args' in words else len(words)
    ours = [word for word in words[1:end] if re.match(r'[A-Za-z]\w*:=', word)]
    if not ours or not any(word.endswith('.xacro') for word in words[1:end]):
        return words, {}
    pairs = [word.partition(':=') for word in ours]
    return ([words[0], *(word for word in words[1:end] if word not in ours), *words[end:]],
            {name: value for name, _, value in pairs})


def main(argv: Sequence[str] | None = None, name: str = NAME) -> int:
    """Run the executable under a name, also the node's; return its exit status."""
    examples = [(f'{name} {arguments}', what) for arguments, what in _EXAMPLES]
    parser = Parser(name, _DESCRIPTION, examples, epilog=describe(SETTINGS))
    parser.add_argument('--urdf', metavar='FILE',
                        help='read the robot from a file, and reload it when the file is edited; '
                        'after a file that ends in .xacro, NAME:=VALUE is its argument')
    parser.add_argument('fallback', metavar='FILE', nargs='?', help=argparse.SUPPRESS)
    words, xacro_arguments = _split(sys.argv if argv is None else argv)
    arguments = parser.parse_args(parser.own_arguments(words))
    if arguments.urdf is not None and arguments.fallback is not None:
        parser.error(f'{arguments.fallback!r} and --urdf {arguments.urdf}: give one file')
    return run(name, words, lambda ended: spin(
        UrdfBroadcaster(arguments.urdf, name, xacro_arguments, arguments.fallback), ended))


if __name__ == '__main__':
    sys.exit(main())
