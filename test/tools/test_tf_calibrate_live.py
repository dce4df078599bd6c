# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""tf_calibrate over DDS: it reports unobservable directions, and ends with a verdict."""

import json
import threading
import time

from calibration_scenes import EDGE, scene
from programs import PATIENCE_S
import pytest
from tool_helpers import started

rclpy = pytest.importorskip('rclpy')
qos = pytest.importorskip('rclpy.qos')
geometry_msgs = pytest.importorskip('geometry_msgs.msg')
TFMessage = pytest.importorskip('tf2_msgs.msg').TFMessage

MANY = 50


def stamp_of(header, stamp, frame):
    header.stamp.sec, header.stamp.nanosec = divmod(int(stamp), 10**9)
    header.frame_id = frame


def transform(parent, child, stamp, pose):
    made = geometry_msgs.TransformStamped(child_frame_id=child)
    stamp_of(made.header, stamp, parent)
    for part, names, numbers in ((made.transform.translation, 'xyz', pose[:3]),
                                 (made.transform.rotation, 'xyzw', pose[3:])):
        for name, value in zip(names, numbers, strict=True):
            setattr(part, name, float(value))
    return made


def observation(stamp, pose):
    made = geometry_msgs.PoseStamped()
    stamp_of(made.header, stamp, 'camera')
    for part, names, numbers in ((made.pose.position, 'xyz', pose[:3]),
                                 (made.pose.orientation, 'xyzw', pose[3:])):
        for name, value in zip(names, numbers, strict=True):
            setattr(part, name, float(value))
    return made


class Robot:
    """A node that publishes a scene, repeatedly."""

    def __init__(self, given):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('calibrated_robot', context=self.context)
        latched = qos.QoSProfile(depth=1, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL)
        self.static = self.node.create_publisher(TFMessage, '/tf_static', latched)
        self.moving = self.node.create_publisher(TFMessage, '/tf', 100)
        self.target = self.node.create_publisher(geometry_msgs.PoseStamped, '/target', 100)
        stamps = given.buffer.stamps_of('base')
        poses = given.buffer.lookup_many('map', 'base', stamps)
        samples = [transform('map', 'base', *each) for each in zip(stamps, poses, strict=True)]
        self.messages = [TFMessage(transforms=samples[begin:begin + MANY])
                         for begin in range(0, len(samples), MANY)]
        self.seen = [observation(*each) for each in zip(
            given.observations.stamps, given.observations.seen, strict=True)]
        self.static.publish(TFMessage(transforms=[
            transform(*EDGE, 0, given.buffer.lookup(*EDGE))]))

    def drive(self):
        deadline = time.monotonic() + PATIENCE_S
        while not (self.target.get_subscription_count() and self.moving.get_subscription_count()):
            assert time.monotonic() < deadline
            threading.Event().wait(0.05)
        for message in self.messages:
            self.moving.publish(message)
        for message in self.seen:
            self.target.publish(message)

    def close(self):
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def robot():
    made = Robot(scene(1, 60, duration_s=6.0))
    yield made
    made.close()


def test_verdict_comes_at_ctrl_c(robot, tmp_path):
    path = tmp_path / 'found.json'
    program = started('tf_calibrate', '--edge', *EDGE, '--observations', '/target', '--fixed-in',
                      'map', '--time', '--max-offset', '0.2', '--seconds', 600, '-o', path)
    try:
        robot.drive()
        program.wait_for('everything is observable')
        program.interrupt()
        assert program.end() == 1, program.output
    finally:
        program.kill()
    found = json.loads(path.read_text())
    assert found['verdict'] == 'edge and time' and abs(found['time_offset_s'] - 0.08) < 0.005


def test_topic_that_never_comes_is_named(robot):
    program = started('tf_calibrate', '--edge', *EDGE, '--observations', '/nothing',
                      '--fixed-in', 'map', '--seconds', 600)
    try:
        program.wait_for('never seen')
        program.interrupt()
        assert program.end() == 2
    finally:
        program.kill()
    assert 'tf_calibrate: no node published /nothing' in program.output
