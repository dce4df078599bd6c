# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One edited line over DDS: urdf_broadcaster reloads its file while all modules run."""

from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from rclpy.node import Node
from sensor_msgs.msg import JointState
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.messages.convert import time_message
from tf_tree_py.urdf import Robot

from .live_remount import Answer, changes, start_modules, table
from .live_session import executable, session, ticks
from ..one_edge import description, edited
from ..remount import MODULES
from ..report import Report

_EDITED = 'torso'
_PERIOD = from_seconds(0.020)
_PROCESSES = 3


def encoders(node: Node, pipe: Connection) -> None:
    """Publish constant positions of the joints, 50 times a second."""
    robot = Robot.parse(description())
    publisher = node.create_publisher(JointState, 'joint_states', 10)
    message = JointState(name=list(robot.variables), position=[0.1] * len(robot.variables))
    for _ in ticks(pipe, _PERIOD):
        message.header.stamp = time_message(time.time_ns())
        publisher.publish(message)


def run(processes: int = _PROCESSES) -> Report:
    """Start the robot and its modules, and edit a line of the description while they run."""
    text = description()
    with TemporaryDirectory() as folder, session() as lab:
        path = Path(folder) / 'humanoid.urdf'
        path.write_text(text)
        with executable('urdf_broadcaster', '--urdf', str(path)):
            lab.start(encoders)
            pipes, before = start_modules(lab, processes)
            new_text, line = edited(text, _EDITED)
            saved = time.time_ns()
            path.write_text(new_text)
            after = changes(pipes)
    return _report(before, after, saved, line, len(text.splitlines()))


def _report(before: dict[str, Answer], after: dict[str, Answer], saved: int, line: int,
            lines: int) -> Report:
    slowest = max((found.when - saved) / 1e9 for found in after.values())
    return Report(
        tables=[table(f'Line {line} of {lines} is edited, the joint {_EDITED!r}: moved by 1 cm, '
                      'rotated by 2 degrees', before, after, saved)],
        law=f'one of {lines} lines, edited while all processes ran, changed the answers of the '
            f'{len(after)} modules that use that edge within {slowest * 1e3:.0f} ms, and '
            'of no other module: none was restarted, and no other line was edited.',
        remarks=['The node checks its file every 200 ms, which takes most of that time.'],
        numbers={'changed': len(after), 'unchanged': len(MODULES) - len(after), 'lines': lines,
                 'slowest_s': slowest})
