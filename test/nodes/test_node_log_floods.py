# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A thousand bad messages or requests in one second: a line for each kind, and the counts."""

import math

from garbage import told
from geometry_msgs.msg import PoseWithCovarianceStamped
from hand_clock import clock_of_logs
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_helpers import until
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf_tree_py.core import Pose
from tf_tree_py.nodes.edge_switch import EdgeSwitch
from tf_tree_py.nodes.relocalisation_anchor import RelocalisationAnchor
from tf_tree_py.nodes.urdf_broadcaster import UrdfBroadcaster

COUNT = 1000
ARM = """<robot name="{}"><link name="a"/><link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
COVARIANCE = (1e-4 * np.eye(6)).ravel()


@pytest.fixture
def clock(monkeypatch):
    return clock_of_logs(monkeypatch)


@pytest.fixture
def hear(monkeypatch):
    """Return a function that calls back who subscribed to a topic, as an executor does."""
    callbacks, subscribe = {}, Node.create_subscription

    def note(node, kind, topic, callback, *options, **more):
        callbacks[node.resolve_topic_name(topic)] = callback
        return subscribe(node, kind, topic, callback, *options, **more)

    monkeypatch.setattr(Node, 'create_subscription', note)
    return lambda topic, message: callbacks[topic](message)


@pytest.fixture
def make(context, hear):
    """Make nodes that nothing spins."""
    made = []

    def make(cls, *arguments, **parameters):
        made.append(cls(*arguments, context=context, parameter_overrides=[
            Parameter(name, value=value) for name, value in parameters.items()]))
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()


def logged(log):
    """Return the lines that nodes have logged, without hints on lines of their own."""
    return [line for line in log().splitlines() if line.startswith('[')]


def let_counts_be_written(node):
    """Call the timers of a node that nothing spins; a listener's thread has its own time."""
    for timer in node.timers:
        timer.callback()


def assert_told(log, clock, node, kinds, count, before=0):
    """Assert that there is a line for each kind, and after a second the counts of all."""
    assert len(logged(log)[before:]) == kinds
    clock.now += 1.0
    let_counts_be_written(node)
    until(lambda: len(logged(log)[before:]) >= 2 * kinds)
    lines = logged(log)[before:]
    assert len(lines) == 2 * kinds
    assert sum('more like this from' in line for line in lines) == kinds
    assert told(lines) == count


def unusable(cls, number):
    """Return a pose of map -> base_link with one of five faults."""
    message = cls()
    message.header.frame_id = 'map'
    message.header.stamp.sec = 5
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance = COVARIANCE
    turn, way = divmod(number, 5)
    if way == 0:
        message.pose.pose.position.x, message.pose.pose.position.y = math.nan, float(turn)
    elif way == 1:
        message.pose.pose.orientation.w, message.pose.pose.position.x = 0.0, float(turn)
    elif way == 2:
        message.header.frame_id = f'frame_{turn}'
    elif way == 3:
        message.header.stamp.sec, message.pose.pose.position.x = 0, float(turn)
    else:
        message.pose.pose.position.x = math.inf
    return message


def test_poses_that_the_anchor_cannot_use(make, hear, clock, log):
    anchor = make(RelocalisationAnchor)
    for number in range(COUNT):
        hear('/pose', unusable(PoseWithCovarianceStamped, number))
    assert_told(log, clock, anchor, 1, COUNT)


@pytest.mark.parametrize(('jump_above', 'word'), [(0.0, 'relocalisation'), (1.0, 'jump')])
def test_poses_that_relocalise_the_anchor(make, hear, clock, log, jump_above, word):
    """Pairs of poses that agree, each far from the pair before."""
    anchor = make(RelocalisationAnchor, jump_above=jump_above)
    anchor._buffer.insert('odom', 'base_link', 0, Pose(), static=True)
    for number in range(COUNT):
        message = unusable(PoseWithCovarianceStamped, 2)
        message.header.frame_id = 'map'
        message.header.stamp = anchor.get_clock().now().to_msg()
        message.pose.pose.position.x = 1000.0 * (number // 8)
        hear('/pose', message)
        anchor.publish()
    # Besides, some are refused beyond the gate, and the first one has no other that confirms it.
    assert len(logged(log)) <= 4
    clock.now += 1.0
    until(lambda: f': {word}, in 1.0 s' in log())
    (line,) = [line for line in logged(log) if f': {word}, in 1.0 s' in line]
    assert told([line]) > 50


def test_messages_and_requests_of_the_switch(make, hear, clock, log):
    switch = make(EdgeSwitch)
    for number in range(COUNT):
        hear('/wheel/odom', unusable(Odometry, number))
    assert_told(log, clock, switch, 1, COUNT)


def test_requests_to_switch(make, hear, clock, log):
    switch = make(EdgeSwitch, parent_frame='map')
    for source in ('wheel', 'vo'):
        message = unusable(Odometry, 2)
        message.header.frame_id = 'map'
        hear(f'/{source}/odom', message)
    calls = [each.callback for each in switch.services if each.srv_type is Trigger]
    assert len(calls) == 2
    for number in range(COUNT):
        calls[number % 2](Trigger.Request(), Trigger.Response())
    # The first request is for the source that is followed already.
    assert_told(log, clock, switch, 2, COUNT - 1)


def test_joint_states(make, hear, clock, log):
    node = make(UrdfBroadcaster, robot_description=ARM.format('arm'))
    for number in range(COUNT):
        message = JointState(name=['j'], position=[0.0])
        message.header.stamp.sec = 1 + number
        turn, way = divmod(number, 4)
        if way == 0:
            message.name = [f'joint_{turn}']
        elif way == 1:
            message.position = [0.0] * (2 + turn)
        else:
            message.position = [math.nan if way == 2 else math.inf]
        hear('/joint_states', message)
    assert_told(log, clock, node, 3, COUNT, before=1)


def test_warnings_of_two_descriptions_are_both_written(make, clock, log):
    """Also if the first warning is the same; and of many, it is said how many there are."""
    shapes = ''.join(f'<visual><geometry><box size="{number} a"/></geometry></visual>'
                     for number in range(30))
    faulty = ARM.format('arm').replace('<link name="a"/>', f'<link name="a">{shapes}</link>')
    node = make(UrdfBroadcaster, robot_description=faulty)
    assert 'and 10 more' in log()
    clock.now += 1.0
    changed = faulty.replace('"1 a"', '"another fault"')
    node.set_parameters([Parameter('robot_description', value=changed)])
    assert log().count("'0 a'") == 2 and 'another fault' in log()


def test_descriptions_that_anyone_sets(make, clock, log):
    node = make(UrdfBroadcaster, robot_description=ARM.format('arm'))
    for number in range(200):
        result, = node.set_parameters([
            Parameter('robot_description', value=ARM.format(f'arm_{number}'))])
        assert result.successful
    assert_told(log, clock, node, 1, 201)
