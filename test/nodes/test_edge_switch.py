# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two odometries of one edge in, one edge without jumps out: over DDS."""

from contextlib import contextmanager
import json
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.exceptions import InvalidNodeNameException
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_helpers import PATIENCE_S, SimClock, until
from std_srvs.srv import Trigger
from tf2_echoes import Tf2Echo
from tf2_msgs.msg import TFMessage
from tf_tree_py.core import Pose, se3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.edge_switch import EdgeSwitch, NAME
from tf_tree_py.nodes.running import ClosingNode, spun_in_background
from tf_tree_py.ros.messages.convert import as_sample, time_message
from tf_tree_py.ros.messages.geometry import pose_message
from tf_tree_py.ros.topics.qos import dynamic_qos

MS = 1_000_000
SECOND = 1_000_000_000
STEP = 10 * MS
MAX_SPEED, MAX_TURN_RATE = 0.2, 0.1
# On a busy machine a source whose sender waits for an answer must not count as silent.
UNHURRIED = {'max_age': 60.0}
# A busy node may be behind with one source by what DDS keeps of it: ten samples, 0.1 s.
MAX_AGE = 0.5
# The camera's odom frame is elsewhere.
ELSEWHERE = Pose.from_xyz_rpy(x=0.05, y=-0.04, yaw=0.02)


class Robot:
    """A robot at 0.1 m/s, two odometries, and the received samples of odom -> base_link."""

    def __init__(self, node):
        self.node = node
        self.begin = time.time_ns()
        self.says = {'wheel': self.went, 'vo': lambda stamp: ELSEWHERE @ self.went(stamp)}
        self.heard = []
        self.said = {name: node.create_publisher(Odometry, f'{name}/odom', 10)
                     for name in self.says}
        node.create_subscription(TFMessage, 'tf', self._hear, dynamic_qos())
        self.stamp = self.begin

    def went(self, stamp):
        return Pose(x=0.1 * (stamp - self.begin) / SECOND)

    def _hear(self, message):
        self.heard += [sample for sample in map(as_sample, message.transforms)
                       if sample.child == 'base_link']

    def diagnoses(self):
        """Return a list to which every status on /diagnostics is added."""
        statuses = []
        self.node.create_subscription(
            DiagnosticArray, '/diagnostics', lambda message: statuses.extend(message.status), 10)
        return statuses

    def wait_for_switch(self):
        until(lambda: all(each.get_subscription_count() for each in self.said.values()))

    def say(self, name, stamp, frame='odom', child='base_link'):
        message = Odometry(child_frame_id=child)
        message.header.frame_id, message.header.stamp = frame, time_message(stamp)
        message.pose.pose = pose_message(self.says[name](stamp))
        self.said[name].publish(message)

    def drive(self, *names, until_it_is):
        """Drive step by step, at the pace of the received samples, until a condition holds."""
        deadline = time.monotonic() + PATIENCE_S
        while not until_it_is():
            assert time.monotonic() < deadline
            # No faster than real time, otherwise the stamps get ahead of the clock.
            until(lambda: time.time_ns() >= self.stamp + STEP)
            self.stamp += STEP
            for name in names:
                self.say(name, self.stamp)

    def is_where(self, source):
        """Return whether the edge has the pose of a source."""
        return bool(self.heard) and max(se3.distance(
            self.heard[-1].pose, self.says[source](self.heard[-1].stamp))) < 1e-6

    def is_heard(self, count=1):
        return lambda: len(self.heard) >= count

    def ask(self, source):
        """Request a source; return the response."""
        client = self.node.create_client(Trigger, f'{NAME}/switch_to/{source}')
        until(client.service_is_ready)
        answer = client.call_async(Trigger.Request())
        until(answer.done)
        return answer.result()

    def assert_no_faster_than_stated(self):
        heard = list(self.heard)  # more may still arrive
        stamps = np.array([sample.stamp for sample in heard])
        poses = np.array([sample.pose for sample in heard])
        assert (np.diff(stamps) > 0).all()
        gone, turned = se3.distance_many(poses[:-1], poses[1:])
        seconds = np.diff(stamps) / SECOND
        speeds = gone / seconds
        # It blends, faster or slower than the robot drives.
        assert abs(speeds - 0.1).max() > 0.02 and speeds.max() <= 0.1 + MAX_SPEED + 1e-5
        assert (turned / seconds).max() <= MAX_TURN_RATE + 1e-5


@pytest.fixture
def robot(robot_node):
    return Robot(robot_node)


@contextmanager
def switching(context, robot, **parameters):
    node = EdgeSwitch(context=context, parameter_overrides=[
        Parameter(name.replace('__', '.'), value=value) for name, value in parameters.items()])
    with spun_in_background(node):
        robot.wait_for_switch()
        yield node


def test_edge_is_the_preferred_source_and_goes_over_when_it_is_asked_to(context, robot):
    with switching(context, robot, **UNHURRIED):
        too_early = robot.ask('vo')
        robot.drive('wheel', 'vo', until_it_is=robot.is_heard(5))
        robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('wheel'))
        answer = robot.ask('vo')
        # The other source may be a sample behind.
        assert answer.success and answer.message.startswith(
            ('the switch lasts from ', "the switch begins as soon as 'vo' has reached "))
        robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('vo'))
        again = robot.ask('vo')
    assert not again.success and 'already' in again.message
    assert not too_early.success and too_early.message == 'no source has been received yet'
    robot.assert_no_faster_than_stated()


def test_silent_source_is_replaced_and_reported(
        context, robot, capfd):
    statuses = robot.diagnoses()
    with switching(context, robot, max_age=MAX_AGE):
        robot.drive('wheel', 'vo', until_it_is=robot.is_heard(5))
        robot.drive('vo', until_it_is=lambda: robot.is_where('vo'))
        # It drives on, because a status is about the present: soon, both sources would be silent.
        robot.drive('vo', until_it_is=lambda: any(
            f'{NAME}: tf odom -> base_link' == status.name
            and "'wheel' was replaced" in status.message for status in statuses))
    assert "the source 'wheel' sent nothing for more than 500 ms" in capfd.readouterr().err
    robot.assert_no_faster_than_stated()


def test_the_first_of_the_list_is_gone_over_to_if_another_was_heard_before(context, robot):
    with switching(context, robot, **UNHURRIED):
        robot.drive('vo', until_it_is=lambda: robot.is_where('vo'))
        robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('wheel'))
    robot.assert_no_faster_than_stated()


def test_better_source_that_is_steady_again_is_gone_back_to(context, robot, capfd):
    with switching(context, robot, max_age=MAX_AGE, prefer=['wheel', 'vo'], steady=0.2):
        robot.drive('wheel', 'vo', until_it_is=robot.is_heard(5))
        robot.drive('vo', until_it_is=lambda: robot.is_where('vo'))
        robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('wheel'))
    assert 'is steady again' in capfd.readouterr().err
    assert (np.diff([sample.stamp for sample in robot.heard]) > 0).all()


def test_order_names_sources(context):
    for wrong in (['wheels'], ['wheel', 'wheel']):
        with pytest.raises(BadInput, match='prefer'):
            EdgeSwitch(context=context, parameter_overrides=[Parameter('prefer', value=wrong)])


def test_node_that_is_refused_leaves_no_publisher(context):
    watching = Node('watching', context=context)
    with pytest.raises(BadInput, match='its own output') as kept:
        EdgeSwitch(context=context, parameter_overrides=[Parameter('wheel.topic', value='/tf')])
    until(lambda: not watching.count_publishers('/tf'))
    assert kept.tb  # the traceback keeps the node alive, as in a program that logs the error
    watching.destroy_node()


def test_name_that_is_refused_is_the_error(context):
    with pytest.raises(InvalidNodeNameException):
        ClosingNode('two words', context=context)


def buffer_of(node):
    return node._buffer


def test_clock_that_goes_back_begins_another_run(context, robot):
    clock = SimClock(robot.node)
    with switching(context, robot, use_sim_time=True, over=100.0) as node:
        for begin in (100, 50):
            clock.show(float(begin), buffer_of(node))
            for stamp in range(begin * SECOND, begin * SECOND + 100 * MS, STEP):
                robot.say('wheel', stamp)
                robot.say('vo', stamp)
            until(lambda begin=begin: robot.heard
                  and robot.heard[-1].stamp == begin * SECOND + 90 * MS)
            robot.ask('vo')  # a blend that the jump ends
    second = [sample for sample in robot.heard if sample.stamp < 100 * SECOND]
    assert len(second) == 10
    for sample in second:
        assert max(se3.distance(sample.pose, robot.went(sample.stamp))) < 1e-6


def test_messages_of_other_types_are_taken(context, robot):
    robot.said = {'a': robot.node.create_publisher(TFMessage, 'a', 10),
                  'b': robot.node.create_publisher(PoseStamped, 'b/pose', 10)}
    with switching(context, robot, sources=['a', 'b'], a__topic='a', b__topic='b/pose',
                   a__type='tf2_msgs/msg/TFMessage', b__type='PoseStamped') as node:
        robot.said['a'].publish(write([
            Sample('odom', 'other', robot.stamp, Pose(x=9.0)),
            Sample('odom', 'base_link', robot.stamp, Pose(x=1.0))]))
        until(robot.is_heard())
        message = PoseStamped(pose=pose_message(Pose(x=2.0)))
        message.header.frame_id, message.header.stamp = 'odom', time_message(robot.stamp)
        robot.said['b'].publish(message)
        until(lambda: len(buffer_of(node).sources_of('base_link')) == 2)
    assert [(sample.parent, sample.child, sample.pose[0]) for sample in robot.heard] == [
        ('odom', 'base_link', 1.0)]


def test_what_is_of_no_use_is_told_and_no_more(context, robot, log):
    unfilled = Odometry(child_frame_id='base_link')
    unfilled.header.stamp = time_message(robot.stamp)
    unfilled.pose.pose.orientation.w = 0.0
    impossible = Odometry(child_frame_id='base_link')
    impossible.header.stamp.nanosec = 10**9
    with switching(context, robot):
        robot.say('wheel', robot.stamp, frame='map')
        until(lambda: "'map' -> 'base_link', not 'odom' -> 'base_link'" in log())
        robot.say('wheel', robot.stamp + 60 * SECOND)
        until(lambda: 'too far in the future' in log())
        # The first complaint was just logged, so these are neither logged nor published.
        for message in (Odometry(child_frame_id='base_link'), unfilled, impossible):
            message.header.frame_id = 'odom'
            robot.said['wheel'].publish(message)
        robot.drive('wheel', until_it_is=robot.is_heard(2))
    assert robot.heard[0].stamp > robot.begin


@pytest.mark.parametrize('parameters, why', [
    ({'sources': ['wheel']}, 'two or more names'),
    ({'sources': ['wheel', 'wheel']}, 'two or more names'),
    ({'sources': ['wheel', '/vo/odom']}, 'two or more names'),
    ({'child_frame': '/'}, 'child_frame'),
    ({'vo.type': 'sensor_msgs/msg/Imu'}, 'use one of Odometry'),
    ({'vo.topic': 'no topic'}, 'vo.topic must be a topic'),
    ({'vo.topic': '/tf', 'vo.type': 'TFMessage'}, 'would receive its own output'),
    ({'max_speed': 0.0}, 'max_speed')])
def test_wrong_parameter_is_one_sentence(context, parameters, why):
    with pytest.raises(BadInput, match=why):
        EdgeSwitch(context=context, parameter_overrides=[
            Parameter(name, value=value) for name, value in parameters.items()])


def test_program_runs_and_ends_with_ctrl_c(start, robot):
    program = start(NAME, '--ros-args', '-p', 'max_age:=0.2')
    robot.wait_for_switch()
    robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('wheel'))
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_doctor_tells_of_a_source_that_made_way_before_it_came(context, robot, start_program):
    told = robot.diagnoses()
    with switching(context, robot, max_age=MAX_AGE):
        robot.drive('wheel', 'vo', until_it_is=robot.is_heard(5))
        robot.drive('vo', until_it_is=lambda: robot.is_where('vo'))
        doctor = start_program(sys.executable, '-m', 'tf_tree_py.tools.tf_doctor', '--json')
        robot.drive('vo', until_it_is=lambda: robot.node.count_subscribers('/diagnostics') == 2)
        until_told = len(told) + 6  # three times, about the buffer and the edge
        robot.drive('vo', until_it_is=lambda: len(told) >= until_told)
        doctor.interrupt()
        doctor.end()
    report = json.loads(doctor.output[doctor.output.index('{'):])
    found = {finding['code']: finding for finding in report['findings']}['source_silent']
    assert (found['severity'], found['publishers']) == ('warning', ['wheel'])
    assert found['frames'] == ['odom', 'base_link'] and found['evidence'] == {'count': 1}
    assert "'wheel' sent nothing for more than 500 ms" in found['summary']


# --- nodes without this package

@pytest.fixture
def tf2_echo():
    """Return tf2's own C++ program, listening to odom -> base_link."""
    program = Tf2Echo('odom', 'base_link')
    yield program
    program.kill()


def test_tf2_echo_sees_the_switch_and_nothing_faster_than_stated(context, robot, tf2_echo):
    def has_heard(more):
        return len(tf2_echo.samples[0]) >= more

    with switching(context, robot):
        robot.drive('wheel', 'vo', until_it_is=lambda: has_heard(5))
        assert robot.ask('vo').success
        robot.drive('wheel', 'vo', until_it_is=lambda: robot.is_where('vo'))
        more = len(tf2_echo.samples[0]) + 3
        robot.drive('wheel', 'vo', until_it_is=lambda: has_heard(more))
    _, places = tf2_echo.samples
    # It has intermediate positions, and ends at the other source.
    assert len({*places[:, 1]}) > 5 and places[0, 1] == 0.0 and places[-1, 1] < -0.02
    tf2_echo.assert_no_faster(0.1 + MAX_SPEED)
