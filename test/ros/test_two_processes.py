# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A publisher in another process: shared memory, discovery, and its death."""

import subprocess
import sys
import textwrap

import pytest
from ros_helpers import at, LATEST, PATIENCE, PATIENCE_S, until

PROGRAM = """
    import sys

    from geometry_msgs.msg import TransformStamped
    import rclpy
    from rclpy.time import Time
    from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster

    def transform(parent, child, second):
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id = parent
        message.header.stamp = Time(seconds=second).to_msg()
        return message

    rclpy.init()
    node = rclpy.create_node('robot', namespace='/far')
    fixed, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
    fixed.sendTransform(transform('base', 'camera', 0))
    print('ready', flush=True)
    # Each line asks for one message at that time; the end of the input is the end.
    for line in sys.stdin:
        moving.sendTransform([transform('map', 'base', int(line))])
    rclpy.shutdown()
"""


@pytest.fixture
def robot():
    process = subprocess.Popen(
        [sys.executable, '-c', textwrap.dedent(PROGRAM)], text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    yield process
    process.stdin.close()
    assert process.wait(PATIENCE_S) == 0


def test_transforms_cross_the_border_of_processes(robot, node, make_node, listen):
    early = listen(node)
    assert robot.stdout.readline() == 'ready\n'
    early.lookup_transform('base', 'camera', LATEST, PATIENCE)
    late = listen(make_node('late'))
    late.lookup_transform('base', 'camera', LATEST, PATIENCE)
    # Static and moving publishers of one process are not discovered at the same moment.
    until(lambda: node.count_publishers('/tf'))

    def moved():
        print(7, file=robot.stdin, flush=True)
        return all(buffer.can_transform('map', 'camera', at(7.0)) for buffer in (early, late))

    until(moved)
    for buffer in (early, late):
        until(lambda buffer=buffer: {edge.authority for edge in buffer.edges()} == {'/far/robot'})
    robot.stdin.close()
    robot.wait(PATIENCE_S)
    until(lambda: not node.count_publishers('/tf'))
    for buffer in (early, late):
        assert buffer.can_transform('map', 'camera', at(7.0)), 'its frames outlive it'
