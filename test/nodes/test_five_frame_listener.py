# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The output of five_frame_listener with data, before the data, and after its end."""

from contextlib import contextmanager
import math
import queue
import re
import signal
import threading

from programs import PATIENCE_S
import pytest
from rclpy.parameter import Parameter
from rclpy.task import Future
from tf_tree_py import Buffer, TransformException
from tf_tree_py.core import Pose
from tf_tree_py.nodes import five_frame_listener
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.five_frame_listener import FiveFrameListener
from tf_tree_py.nodes.five_frame_publisher import FiveFramePublisher
from tf_tree_py.nodes.running import spin, spun_in_background
from tf_tree_py.ros.messages.convert import transform_stamped


def listener(context, **parameters):
    parameters = {'rate_hz': 20.0, 'timeout_s': 0.2, **parameters}
    return FiveFrameListener(context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])


class Said:
    """The output of the listener, line by line."""

    def __init__(self):
        self.lines = queue.Queue()

    def next_line(self):
        return self.lines.get(timeout=PATIENCE_S)

    def next_answer(self):
        """Return the next line with a pose; a busy machine leaves gaps, which are also printed."""
        while 'xyz' not in (line := self.next_line()):
            pass
        return line

    def next_unlike(self, kind):
        while kind in (line := self.next_line()):
            pass
        return line


@pytest.fixture
def said(monkeypatch):
    said = Said()
    monkeypatch.setattr(five_frame_listener, 'say', said.lines.put)
    return said


@contextmanager
def publishing(context):
    node = FiveFramePublisher(context=context)
    with spun_in_background(node):
        yield node


def test_answers_are_the_true_pose_at_the_stamp(context, said):
    with publishing(context) as publisher, spun_in_background(listener(context)):
        for _ in range(5):
            line = said.next_answer()
            stamp, x, y, z, roll, pitch, yaw, age = map(float, re.findall(r'-?\d+\.?\d*', line))
            truth = publisher.motion.world_T_gripper(round(stamp * 1e3) * 1_000_000)
            # The stamp is printed with a resolution of 1 ms, in which the gripper moves this far.
            assert (x, y, z) == pytest.approx(truth.translation, abs=3e-3)
            angles = Pose.from_xyz_rpy(0, 0, 0, *map(math.radians, (roll, pitch, yaw)))
            turned = Pose(0, 0, 0, *truth.rotation).inverse() @ angles
            assert math.hypot(*turned.as_rotation_vector()) < 3e-3
            assert 0 <= age < 1000


def test_what_is_missing_is_said_once_and_again_when_it_stops(context, said):
    # A second without data is longer than the gaps that a busy machine leaves.
    with spun_in_background(listener(context, timeout_s=1.0)):
        assert said.next_line().startswith('waiting for world -> gripper: "world" passed to')
        with publishing(context):
            assert 'xyz' in said.next_line()
        stopped = said.next_unlike('xyz')
        # Its stamp may be between the last samples of two edges. On a busy machine, the last ones
        # are taken after their node has left the graph.
        assert re.match(
            'no new data of world -> gripper: world -> odom(, odom -> base_link)?'
            '(, base_link -> gripper)?, sent by /five_frame_publisher'
            '(, unknown publisher of /tf)?, ended ', stopped)
        with publishing(context):
            assert 'xyz' in said.next_line()
        assert said.next_unlike('xyz').startswith('no new data of')
    assert said.lines.empty()


def test_only_edges_between_the_two_that_stopped_are_named(context, said):
    node = listener(context)
    now = node.get_clock().now().nanoseconds
    for parent, child, newest_s in (('sun', 'world', -9), ('world', 'odom', -9),
                                    ('odom', 'gripper', 9), ('gripper', 'finger', -9)):
        for stamp in (now - 9_000_000_000, now + newest_s * 1_000_000_000):
            node.buffer.set_transform(transform_stamped(parent, child, stamp, Pose()), 'me')
    with spun_in_background(node):
        line = said.next_line()
    assert re.fullmatch(r'waiting for world -> gripper: world -> odom, sent by me, ended 9\.\d+ s '
                        'before the requested stamp', line)


def test_sim_time_without_a_clock_is_told(context, said):
    with spun_in_background(listener(context, use_sim_time=True)):
        assert 'nothing has been received on /clock' in said.next_line()


@pytest.mark.parametrize(('stamp_s', 'told'), [
    (5, 'world -> gripper, sent by me, ended '), (2.1e9, 'world -> gripper begins ')])
def test_data_by_another_clock_is_told(context, said, stamp_s, told):
    node = listener(context)
    stamp = round(stamp_s * 1e9)
    node.buffer.set_transform(transform_stamped('world', 'gripper', stamp, Pose()), 'me')
    with spun_in_background(node):
        line = said.next_line()
    assert line.startswith(f'waiting for world -> gripper: {told}')
    assert 'use_sim_time' in line


def test_wait_is_given_up_when_the_program_ends(context, said, monkeypatch):
    node = listener(context, timeout_s=60.0)
    ended, over = Future(), threading.Event()
    ended.add_done_callback(node.give_up)

    def end():
        ended.set_result(None)
        while not over.wait(0.1):  # the wait may not have begun yet
            node.give_up()

    def lookup(*arguments):
        ending.start()
        try:
            with pytest.raises(TransformException, match='given up') as error:
                Buffer.lookup_transform(node.buffer, *arguments)
            raise error.value
        finally:
            over.set()

    ending = threading.Thread(target=end)
    monkeypatch.setattr(node.buffer, 'lookup_transform', lookup)
    spin(node, ended)
    ending.join()
    assert said.lines.empty()


@pytest.mark.parametrize(('name', 'value', 'message'), [
    ('rate_hz', 1000.0, 'rate_hz must be a number from 0.01 to 100.0'),
    ('timeout_s', -1.0, 'timeout_s must be'),
    ('source_frame', '/gripper', 'without a leading slash'),
    ('target_frame', '', 'not empty'),
])
def test_parameter_that_cannot_be_is_refused(context, name, value, message):
    with pytest.raises(BadInput, match=message):
        listener(context, **{name: value})


def test_two_processes_with_the_listener_first(start):
    listening = start('five_frame_listener', '--ros-args', '-p', 'rate_hz:=10')
    listening.wait_for('waiting for world -> gripper')
    publishing = start('five_frame_publisher')
    listening.wait_for('xyz', count=3)
    publishing.interrupt()
    assert publishing.end() == 0
    assert publishing.output == ''
    listening.wait_for('no new data of world -> gripper')
    listening.interrupt()
    assert listening.end() == 0
    assert listening.output.count('waiting for') == 1
    assert listening.output.count('no new data') == 1
    assert 'Traceback' not in listening.output


def test_sigterm_is_a_normal_end_too(start):
    listening = start('five_frame_listener')
    listening.wait_for('The pose of gripper in world')
    listening.interrupt(signal.SIGTERM)
    assert listening.end() == 0
    assert 'Traceback' not in listening.output
