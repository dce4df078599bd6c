# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the tools say over DDS where transforms are on another topic, or time is not as usual."""

from argparse import Namespace
from contextlib import contextmanager
import itertools
import json

from conditions import repeated, until
from programs import PATIENCE_S
import pytest
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core import Pose
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.tools.doctor_report import judged
from tool_helpers import started

rclpy = pytest.importorskip('rclpy')
live_tree = pytest.importorskip('tf_tree_py.tools.live_tree')

SECOND = 10**9
ELSEWHERE = ('Transforms (tf2_msgs/msg/TFMessage) are also published on /robot1/tf by '
             '/robot1/wheel_odometry')


class Robot:
    """Nodes in this process that publish transforms and clocks."""

    def __init__(self, context):
        self._context = context
        self._nodes = []

    def node(self, name, namespace='/', simulated=False):
        from rclpy.parameter import Parameter
        self._nodes.append(rclpy.create_node(
            name, context=self._context, namespace=namespace,
            parameter_overrides=[Parameter('use_sim_time', value=simulated)]))
        return self._nodes[-1]

    def sender(self, node, topic, parent, child, static=False):
        """Return a function that publishes an edge with a stamp, seconds."""
        from tf2_msgs.msg import TFMessage
        from tf_tree_py.ros.messages.convert import transform_stamped
        from tf_tree_py.ros.topics.qos import dynamic_qos, static_broadcaster_qos
        publisher = node.create_publisher(
            TFMessage, topic, static_broadcaster_qos() if static else dynamic_qos())
        return lambda stamp_s=0.0: publisher.publish(TFMessage(transforms=[transform_stamped(
            parent, child, round(stamp_s * SECOND), Pose())]))

    def clock(self, name):
        from rosgraph_msgs.msg import Clock
        return self.node(name).create_publisher(Clock, '/clock', 1)

    def close(self):
        while self._nodes:
            self._nodes.pop().destroy_node()


@pytest.fixture
def robot(context):
    robot = Robot(context)
    yield robot
    robot.close()


@contextmanager
def live(doctor, *ros_arguments):
    arguments = Namespace(tf_topic=None, tf_static_topic=None,
                          ros_arguments=['--ros-args', *ros_arguments] if ros_arguments else [])
    with live_tree.LiveTree(arguments, 'watching', [doctor]) as tree_input:
        yield tree_input


@contextmanager
def running(name, *arguments):
    program = started(name, *arguments)
    try:
        yield program
    finally:
        program.kill()


def answers(program):
    return [json.loads(line) for line in program.output.splitlines()
            if line.startswith('{') and line.endswith('}')]


def codes(tree_input, doctor):
    return {one.code for one in judged(tree_input, doctor)[1]}


# --- another topic

def test_tools_name_the_other_topic_and_the_option_reads_it(robot):
    wheels = robot.node('wheel_odometry', '/robot1')
    send = robot.sender(wheels, 'tf', 'odom', 'base_link')
    option = '--tf-topic', '/robot1/tf'
    with running('tf_echo', 'odom', 'base_link') as echo, \
            running('tf_echo', 'odom', 'base_link', '--json', '--rate', 5) as echo_json, \
            running('tf_monitor', '--period', 0.5) as monitor:
        echo.wait_for(f'  {ELSEWHERE}. Pass --tf-topic /robot1/tf to read that instead; or')
        echo_json.wait_for(f'"hints": ["{ELSEWHERE}. Pass')
        until(lambda: f'{ELSEWHERE}. Pass --tf-topic /robot1/tf to read that instead' in (
            ' '.join(monitor.output.split())))
        assert 'warning other_topic' not in monitor.output, 'the hint has said it'
        for program in (echo, echo_json, monitor):
            program.interrupt()
            assert program.end() == 2
        assert f'no transform arrived from /tf and /tf_static: {ELSEWHERE}' in echo.output
    with running('tf_echo', 'odom', 'base_link', *option, '--rate', 50) as echo:
        until(lambda: send(1.0) or 'xyz' in echo.output)
        echo.interrupt()
        assert echo.end() == 0
        assert 'also published' not in echo.output.partition('xyz')[2]


def test_doctor_names_the_other_topic_only_where_something_is_missing(robot):
    """Also where only static edges arrive: all that moves may be there."""
    robot.sender(robot.node('wheel_odometry', '/robot1'), 'tf', 'odom', 'base_link')
    doctor = Doctor()
    with live(doctor) as tree_input:
        until(lambda: any(one.node == '/robot1/wheel_odometry'
                          for one in tree_input.graph().elsewhere))
        with pytest.raises(Cannot, match=r'also published on /robot1/tf by /robot1/wheel'):
            judged(tree_input, doctor)
        mounts = robot.node('mounts')
        robot.sender(mounts, '/tf_static', 'base_link', 'lidar', static=True)()
        until(lambda: doctor.transforms == 1)
        assert codes(tree_input, doctor) == {'other_topic'}
        lift = robot.sender(robot.node('lift'), '/tf', 'base_link', 'lift')
        until(lambda: lift(1.0) or doctor.transforms > 1)
        assert 'other_topic' not in codes(tree_input, doctor)
        robot.sender(robot.node('dock'), '/tf_static', 'map', 'dock', static=True)()
        separate = {'unconnected', 'other_topic'}
        until(lambda: separate <= codes(tree_input, doctor))
        robot.sender(robot.node('maps'), '/tf_static', 'map', 'base_link', static=True)()
        until(lambda: not separate & codes(tree_input, doctor))


def test_frames_names_the_other_topic_below_the_separate_trees(robot):
    robot.sender(robot.node('wheel_odometry', '/robot1'), 'tf', 'odom', 'base_link')
    robot.sender(robot.node('mounts'), '/tf_static', 'base_link', 'lidar', static=True)()
    robot.sender(robot.node('dock'), '/tf_static', 'map', 'dock', static=True)()

    def frames():
        with running('tf_frames', '--seconds', 3) as program:
            return program.end(), ' '.join(program.output.split())

    status, said = repeated(frames, lambda result: 'other_topic' in result[1])
    assert status == 1
    assert f'other_topic: {ELSEWHERE}. Pass --tf-topic /robot1/tf to read' in said


def test_silence_is_explained_by_what_the_graph_shows(robot, monkeypatch):
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from tf2_msgs.msg import TFMessage
    monkeypatch.setattr(live_tree, 'SETTLED_S', PATIENCE_S)
    doctor = Doctor()
    with live(doctor) as tree_input:
        hint = tree_input.hint
        assert 'does any node publish there with the same ROS_DOMAIN_ID, which is' in hint
        monkeypatch.setattr(live_tree, 'SETTLED_S', 0.0)
        assert tree_input.hint.startswith('no node publishes tf2_msgs/msg/TFMessage on any topic.')
        robot.sender(robot.node('wheels'), '/tf', 'odom', 'base_link')
        until(lambda: tree_input.hint == '/wheels publishes there, but nothing has arrived')
        best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        robot.node('driver').create_publisher(TFMessage, '/tf', best_effort)
        until(lambda: '/driver, /wheels publish there, but nothing has arrived. /driver publishes '
              '/tf as best effort' in tree_input.hint)


# --- simulated time

def test_doctor_names_the_nodes_that_lack_a_clock(robot, monkeypatch):
    monkeypatch.setattr(live_tree, 'SETTLED_S', PATIENCE_S)
    robot.node('planner', simulated=True)
    doctor = Doctor()
    with live(doctor) as tree_input:
        until(lambda: [*tree_input.graph().clock_users] == ['/planner'])
        robot.sender(robot.node('mounts'), '/tf_static', 'base_link', 'lidar', static=True)()
        until(lambda: doctor.transforms)
        assert codes(tree_input, doctor) == set(), 'a publisher may still appear'
        monkeypatch.setattr(live_tree, 'SETTLED_S', 0.0)
        finding, = judged(tree_input, doctor)[1]
        assert (finding.code, finding.severity.value) == ('no_clock', 'warning')
        assert finding.publishers == ('/planner',)
        robot.clock('gazebo')
        until(lambda: tree_input.graph().clocks)
        assert codes(tree_input, doctor) == set()
        robot.clock('ros2_bag_player')
        until(lambda: {*tree_input.graph().clocks} == {'/gazebo', '/ros2_bag_player'})
        finding, = judged(tree_input, doctor)[1]
        assert finding.summary == '/clock has 2 publishers: /gazebo, /ros2_bag_player'


def test_own_simulated_time_without_a_clock_is_an_error_also_without_transforms(monkeypatch):
    monkeypatch.setattr(live_tree, 'SETTLED_S', 0.0)
    doctor = Doctor()
    with live(doctor, '-p', 'use_sim_time:=true') as tree_input:
        report, (finding,) = judged(tree_input, doctor)
        assert (finding.code, report['errors'], report['transforms']) == ('no_clock', 1, 0)
        assert finding.summary == 'this node uses simulated time, and nothing publishes /clock'
        assert 'this node uses simulated time' not in tree_input.hint.lower().partition('. ')[0]
        assert 'This node uses simulated time, and nothing publishes /clock' in tree_input.hint


def test_echo_names_the_missing_clock_where_no_data_comes(robot):
    send = robot.sender(robot.node('wheels', simulated=True), '/tf', 'odom', 'base_link')
    arguments = 'odom', 'base_link', '--rate', 10
    with running('tf_echo', *arguments) as echo, \
            running('tf_echo', *arguments, '--json') as echo_json:
        echo.wait_for('  Nothing publishes /clock, to which /wheels subscribes, as nodes with')
        echo_json.wait_for('"hints": ["Nothing publishes /clock')
        stamps = itertools.count(1000)
        until(lambda: send(next(stamps) / 1000.0) or any(
            one['translation'] and not one['hints'] for one in answers(echo_json)))
        echo.wait_for('no new data of odom -> base_link')
        echo.interrupt()
        assert echo.end() == 0


# --- another run

def test_echo_says_that_another_run_is_refused_and_by_whom(robot):
    send = robot.sender(robot.node('wheels'), '/tf', 'odom', 'base_link')
    arguments = 'odom', 'base_link', '--rate', 10
    with running('tf_echo', *arguments) as echo, \
            running('tf_echo', *arguments, '--json') as echo_json:
        until(lambda: send(1000.0) or (
            'xyz' in echo.output and '"translation": [' in echo_json.output))
        stamps = itertools.count(1000)

        def both_say(text):
            send(next(stamps) / 1000.0)
            return text in echo.output and text in echo_json.output

        until(lambda: both_say('of odom -> base_link from /wheels were refused'))
        until(lambda: echo.output.count('no new data of odom -> base_link') > 3)
        for program in (echo, echo_json):
            program.interrupt()
            assert program.end() == 0
    line, = (line for line in echo.output.splitlines() if 'were refused' in line)
    assert 'its newest stamp is 1000.000000000, and the newest of theirs 1.' in line
    assert line.endswith('Restart tf_echo to see the new data')
    assert any('were refused' in text for one in answers(echo_json) for text in one['hints'])
