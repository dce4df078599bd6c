# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the doctor reads from the ROS graph: transforms on other topics, and simulated time."""

from clock_scenes import case_of, edge_of, found, regular
import pytest
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.checks.graph import GRAPH_CODES, graph_findings
from tf_tree_py.health.ros_graph import RosGraph


def publisher(topic, node='/node', static=False):
    return Endpoint(topic, static, node, True, True, static)


def moving(*names):
    return [edge_of(name, regular(30)) for name in names]


def fixed(*names):
    return [edge_of(name, regular(1), static=True) for name in names]


ROBOT = RosGraph([publisher('/robot/tf', '/robot/base'),
                  publisher('/robot/tf_static', '/robot/urdf', True)])
READ_ROBOT = ('pass --tf-topic /robot/tf --tf-static-topic /robot/tf_static to read that instead; '
              'or start the nodes there with --ros-args -r /robot/tf:=/tf '
              '-r /robot/tf_static:=/tf_static, so that all transforms are in one tree')


def test_transforms_on_other_topics_are_reported_with_the_options_that_read_them():
    one, = CODES['other_topic'].findings(case_of(graph=ROBOT))
    assert (one.code, one.severity, one.frames, one.edges) == (
        'other_topic', Severity.WARNING, (), ())
    assert one.publishers == ('/robot/base', '/robot/urdf')
    assert found('other_topic', case_of(graph=ROBOT)) == [(
        'warning', '', 'transforms (tf2_msgs/msg/TFMessage) are also published on /robot/tf by '
        '/robot/base, on /robot/tf_static by /robot/urdf',
        'topics=2, publishers=2', READ_ROBOT)]


@pytest.mark.parametrize(('edges', 'expected'), [
    ([], True),
    (moving('map>odom'), False),
    (fixed('map>odom'), True),
    ([*moving('map>odom'), *fixed('odom>base')], False),
    (moving('map>odom', 'base>arm'), True),
    # Robots with prefixes of their own need no connection.
    (moving('a/map>a/odom', 'b/map>b/odom'), False),
    (moving('a/map>a/odom', 'b/map>b/odom', 'map>odom'), True)])
def test_other_topics_matter_where_something_is_missing(edges, expected):
    case = case_of(*edges, graph=ROBOT)
    assert bool(found('other_topic', case)) is expected
    assert found('other_topic', case_of(*edges)) == []


@pytest.mark.parametrize(('elsewhere', 'expected'), [
    ([publisher('/robot/tf_static', static=True)], False),
    ([publisher('/robot/tf_static')], False),
    ([publisher('/robot/fixed', static=True)], False),
    ([publisher('/robot/fixed'), publisher('/robot/fixed', static=True)], False),
    ([publisher('/robot/tf')], True),
    ([publisher('/robot/tf_static'), publisher('/robot/tf')], True)])
def test_motion_is_missing_only_if_a_topic_has_some(elsewhere, expected):
    case = case_of(*fixed('map>odom'), graph=RosGraph(elsewhere))
    assert bool(found('other_topic', case)) is expected


@pytest.mark.parametrize(('topics', 'fix'), [
    (['/a/tf'], 'pass --tf-topic /a/tf to read that instead; or start the nodes there with '
     '--ros-args -r /a/tf:=/tf, so that all transforms are in one tree'),
    (['/a/tf_static'], 'pass --tf-static-topic /a/tf_static to read that instead; or start the '
     'nodes there with --ros-args -r /a/tf_static:=/tf_static, so that all transforms are in '
     'one tree'),
    (['/tf'], 'pass --tf-topic /tf to read that instead'),
    (['/tf_static'], 'pass --tf-static-topic /tf_static to read that instead'),
    (['/tf', '/a/tf_static'], 'pass --tf-topic /tf --tf-static-topic /a/tf_static to read that '
     'instead; or start the nodes there with --ros-args -r /a/tf_static:=/tf_static, so that '
     'all transforms are in one tree'),
    (['/b/tf', '/a/tf'], 'pass one of them, such as --tf-topic /a/tf'),
    (['/b/tf', '/a/tf', '/a/tf_static'], 'pass one of them, such as --tf-topic /a/tf'),
    (['/b/tf_static', '/c/tf', '/a/tf_static'], 'pass one of them, such as --tf-topic /c/tf'),
    (['/b/tf_static', '/a/tf_static'],
     'pass one of them, such as --tf-static-topic /a/tf_static')])
def test_fix_reads_one_pair_of_topics(topics, fix):
    one, = CODES['other_topic'].findings(case_of(graph=RosGraph(list(map(publisher, topics)))))
    assert one.fix == fix


@pytest.mark.parametrize(('count', 'rest'), [
    (4, ''), (5, ', and on 1 more topics'), (6, ', and on 2 more topics')])
def test_four_topics_and_four_nodes_of_each_are_named(count, rest):
    ends = [publisher(f'/r{number}/tf', f'/n{node}') for number in range(count)
            for node in range(5)]
    ends += [publisher('/r0/tf', ''), publisher('/r0/tf', '/n0')]
    one, = CODES['other_topic'].findings(case_of(graph=RosGraph(ends)))
    nodes = 'by /n0, /n1, /n2, /n3 and'
    assert one.summary == (
        'transforms (tf2_msgs/msg/TFMessage) are also published on /r0/tf '
        f'{nodes} 2 more, on /r1/tf {nodes} 1 more, on /r2/tf {nodes} 1 more, on /r3/tf {nodes} '
        f'1 more{rest}')
    assert one.publishers == ('/n0', '/n1', '/n2', '/n3', '/n4')
    assert one.evidence == {'topics': count, 'publishers': len(ends)}


def test_node_without_a_name_is_unknown():
    one, = CODES['other_topic'].findings(case_of(graph=RosGraph([publisher('/a/tf', '')])))
    assert one.summary.endswith('also published on /a/tf by an unknown node')
    assert one.publishers == ()


# --- simulated time

def clock(**graph):
    """Return what is reported about simulated time."""
    case = case_of(graph=RosGraph(**{'clock_topic': '/sim/clock', 'settled': True, **graph}))
    return found('no_clock', case) + found('two_clocks', case)


@pytest.mark.parametrize(('graph', 'expected'), [
    ({}, []),
    ({'simulated': True, 'settled': False}, []),
    ({'simulated': True, 'clocks': ['/gazebo']}, []),
    ({'clock_users': ['/rviz'], 'clocks': ['']}, []),
    ({'simulated': True}, [
        ('error', '', 'this node uses simulated time, and nothing publishes /sim/clock',
         'publishers=0, subscriptions=0')]),
    ({'clock_users': ['/rviz']}, [
        ('warning', '', 'nothing publishes /sim/clock, to which /rviz subscribes, as nodes with '
         'use_sim_time do', 'publishers=0, subscriptions=1')]),
    ({'simulated': True, 'clock_users': ['/rviz', '/nav', '/rviz']}, [
        ('error', '', 'this node uses simulated time, and nothing publishes /sim/clock, to which '
         '/nav, /rviz subscribe, as nodes with use_sim_time do',
         'publishers=0, subscriptions=2')]),
    ({'clock_users': [f'/n{number}' for number in range(5)]}, [
        ('warning', '', 'nothing publishes /sim/clock, to which /n0, /n1, /n2, /n3 and 1 more '
         'subscribe, as nodes with use_sim_time do', 'publishers=0, subscriptions=5')])])
def test_simulated_time_needs_a_publisher(graph, expected):
    assert clock(**graph) == expected


def test_users_of_simulated_time_are_the_publishers_of_the_finding():
    one, = CODES['no_clock'].findings(case_of(graph=RosGraph(
        clock_users=['/b', '/a', '/b'], settled=True)))
    assert (one.publishers, one.frames, one.edges) == (('/a', '/b'), (), ())


TWO = [('warning', '', '/sim/clock has 2 publishers: /bag, /gazebo', 'publishers=2')]


@pytest.mark.parametrize(('graph', 'expected'), [
    ({'clocks': ['/gazebo', '/bag'], 'simulated': True}, TWO),
    ({'clocks': ['/gazebo', '/bag', '', '/bag'], 'clock_users': ['/rviz']}, TWO),
    ({'clocks': ['/gazebo', '/bag'], 'simulated': True, 'settled': False}, TWO),
    ({'clocks': ['/gazebo', '/bag']}, []),
    ({'clocks': ['/gazebo', '/gazebo', ''], 'simulated': True}, []),
    ({'clocks': [f'/n{number}' for number in range(5)], 'simulated': True}, [
        ('warning', '', '/sim/clock has 5 publishers: /n0, /n1, /n2, /n3 and 1 more',
         'publishers=5')])])
def test_simulated_time_has_one_publisher(graph, expected):
    assert clock(**graph) == expected


def test_publishers_of_the_clock_are_those_of_the_finding():
    one, = CODES['two_clocks'].findings(case_of(graph=RosGraph(
        clocks=['/b', '/a'], simulated=True)))
    assert (one.publishers, one.frames, one.edges) == (('/a', '/b'), (), ())


# --- without data

def test_graph_alone_explains_missing_transforms():
    graph = ROBOT._replace(simulated=True, settled=True)
    ends = [Endpoint('/tf_static', True, '/driver', True, True, False),
            Endpoint('/tf', False, '/quiet', True, False, False)]
    assert [one.code for one in graph_findings(graph, ends)] == [
        'late_joiner', 'qos_mismatch', 'other_topic', 'no_clock']
    assert [one.code for one in graph_findings(graph)] == ['other_topic', 'no_clock']
    assert graph_findings(RosGraph()) == []
    assert sorted(GRAPH_CODES) == ['no_clock', 'other_topic', 'two_clocks']
