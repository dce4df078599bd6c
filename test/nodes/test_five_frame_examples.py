# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The examples run unchanged."""

import itertools
from pathlib import Path
import sys
import threading

from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
from programs import PATIENCE_S
import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core import Pose
from tf_tree_py.nodes.five_frame_publisher import FiveFramePublisher
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_nanoseconds
from tf_tree_py.ros.messages.pose_covariances import pose_with_covariance_stamped

# In the camera's frame.
SEEN = (1.5, 0.0, 0.0)
EXAMPLES = Path(__file__).parents[2] / 'examples'
# rclpy raises these for a signal between two waits of an executor, with or without us; the second
# if it takes a message at that moment.
OF_RCLPY = 'RCLError', 'Unable to convert call argument'
WITHOUT_ROS = """
import runpy, sys
for name in ('rclpy', 'geometry_msgs', 'tf2_msgs', 'std_msgs', 'builtin_interfaces'):
    sys.modules[name] = None
runpy.run_path(sys.argv[1])
"""


def assert_ctrl_c_ends(program):
    program.interrupt()
    status = program.end()
    if any(error in program.output for error in OF_RCLPY):
        assert status == 1 and 'tf_tree_py/ros' not in program.output, program.output
    else:
        assert status == 0 and 'Traceback' not in program.output, program.output


def test_notebook_runs_without_ros(start_program):
    notebook = start_program(sys.executable, '-c', WITHOUT_ROS, str(EXAMPLES / 'notebook_core.py'))
    assert notebook.end() == 0, notebook.output
    assert 'by hand as by lookup: True' in notebook.output
    assert 'FutureExtrapolationException' in notebook.output


def test_detection_is_placed_where_it_was_when_it_was_seen(start_program, context, buffer):
    program = start_program(sys.executable, str(EXAMPLES / 'detection_in_map.py'))
    robot = FiveFramePublisher(context=context)
    node = Node('detector', context=context)
    answers, true = [], threading.Event()

    def answer(message):
        answers.append(message)
        # A busy machine leaves gaps, and the robot drives a curve between two samples.
        if place(message) == pytest.approx(true_place(robot.motion, message), abs=1e-3):
            true.set()

    def detect():
        message = PointStamped()
        message.header.frame_id = 'camera'
        message.header.stamp = node.get_clock().now().to_msg()
        message.point.x, message.point.y, message.point.z = SEEN
        publisher.publish(message)

    node.create_subscription(PointStamped, 'detection_in_map', answer, 10)
    publisher = node.create_publisher(PointStamped, 'detection', 10)
    node.create_timer(0.1, detect)
    with spun_in_background(robot), spun_in_background(node):
        assert true.wait(PATIENCE_S), (answers, program.output)
    assert_ctrl_c_ends(program)

    for message in answers:
        assert message.header.frame_id == 'world'
        # This buffer receives the same transforms.
        buffer.lookup_transform('world', 'camera', message.header.stamp,
                                Duration(seconds=PATIENCE_S))
        world_T_camera = buffer.lookup('world', 'camera', as_nanoseconds(message.header.stamp))
        assert place(message) == pytest.approx(world_T_camera @ SEEN, abs=1e-9)


def place(message):
    return message.point.x, message.point.y, message.point.z


def true_place(motion, message):
    stamp = as_nanoseconds(message.header.stamp)
    return (motion.world_T_odom(stamp) @ motion.odom_T_base_link(stamp)
            @ motion.base_link_T_camera) @ SEEN


def test_points_come_with_their_transforms_or_a_reason(start_program, context):
    program = start_program(sys.executable, str(EXAMPLES / 'points_with_transforms.py'))
    robot = FiveFramePublisher(context=context)
    node = Node('detector', context=context)
    frames = itertools.cycle(['camera', ''])

    def detect():
        message = PointStamped()
        message.header.frame_id = next(frames)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    publisher = node.create_publisher(PointStamped, 'detection', 10)
    node.create_timer(0.05, detect)
    with spun_in_background(robot), spun_in_background(node):
        program.wait_for('Point at (')
        program.wait_for('EMPTY_FRAME: its frame_id is empty')
    assert_ctrl_c_ends(program)
    assert ', 0.500) in the world' in program.output


def test_transforms_are_awaited_in_asyncio(start_program, context):
    program = start_program(sys.executable, str(EXAMPLES / 'wait_in_asyncio.py'))
    with spun_in_background(FiveFramePublisher(context=context)):
        assert program.end() == 0, program.output
    assert 'camera at z = 0.500 m' in program.output
    assert '"nowhere" passed to lookupTransform argument source_frame does not exist ' in (
        program.output)


def test_planner_gets_the_margin_of_all_that_is_uncertain(start_program, context):
    program = start_program(sys.executable, str(EXAMPLES / 'detection_with_margin.py'))
    robot = FiveFramePublisher(context=context)
    node = Node('detector', context=context)
    known, answers, wider = np.diag([1e-4] * 3 + [1e-6] * 3), [], threading.Event()

    def answer(message):
        answers.append(message)
        if message.pose.covariance[0] > known[0, 0] + 3e-4:
            wider.set()

    def detect():
        stamp = node.get_clock().now().nanoseconds
        detections.publish(pose_with_covariance_stamped('camera', stamp, Pose(x=1.5), known))
        drive = pose_with_covariance_stamped('odom', stamp, Pose(), 4.0 * np.eye(6) * 1e-4)
        odometries.publish(Odometry(header=drive.header, child_frame_id='base_link',
                                    pose=drive.pose))

    node.create_subscription(PoseWithCovarianceStamped, 'detection_found', answer, 10)
    detections = node.create_publisher(PoseWithCovarianceStamped, 'detection', 10)
    odometries = node.create_publisher(Odometry, 'odometry', 10)
    node.create_timer(0.1, detect)
    with spun_in_background(robot), spun_in_background(node):
        assert wider.wait(PATIENCE_S), (answers, program.output)
        program.wait_for('m more away from it')
    assert_ctrl_c_ends(program)


@pytest.mark.parametrize('name', [
    'detection_in_map.py', 'detection_with_margin.py', 'points_with_transforms.py',
    'wait_in_asyncio.py'])
def test_example_stays_short(name):
    _, _, program = (EXAMPLES / name).read_text().partition('Apache-2.0\n\n')
    assert 10 < len(program.splitlines()) <= 40
