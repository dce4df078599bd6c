# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of publishers, including names that the graph does not have yet, without real nodes."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

from hand_clock import HandClock
from inputs import for_each
import pytest
from rclpy.serialization import serialize_message
from rclpy.topic_endpoint_info import TopicEndpointInfo
from ros_helpers import transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, Incident
from tf_tree_py.core import Kind
from tf_tree_py.core.messages.message_layout import as_published
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.ros.topics import endpoints
from tf_tree_py.ros.topics.endpoints import PublisherNames
from tf_tree_py.ros.topics.feed import TransformFeed
from tf_tree_py.ros.topics.spinner import Spinner

AMCL, SLAM, WHEELS = ('/', 'amcl'), ('/', 'slam'), ('/', 'wheels')
NOBODY = 'unknown publisher of /tf'
UNNAMED = ('_NODE_NAMESPACE_UNKNOWN_', '_NODE_NAME_UNKNOWN_')


class Handle(nullcontext):
    """The handle that determines whether a context is running."""

    running = True

    def ok(self):
        return self.running


class Graph:
    """A node whose view of the graph the test chooses."""

    def __init__(self):
        self.context = SimpleNamespace(handle=Handle())
        self.asked = 0
        self.publishers = []

    def get_fully_qualified_name(self):
        return '/watching'

    def get_publishers_info_by_topic(self, topic):
        assert topic == '/tf'
        self.asked += 1
        return [TopicEndpointInfo(node_namespace=namespace, node_name=name)
                for namespace, name in self.publishers]


@pytest.fixture
def graph():
    graph = Graph()
    graph.publishers.append(AMCL)
    return graph


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(endpoints, 'time', clock)
    return clock


@pytest.fixture
def who(graph, clock):
    return PublisherNames(graph, '/tf')


@for_each(case=[
    ([], NOBODY),
    ([AMCL], '/amcl'),
    ([('/robot', 'localiser')], '/robot/localiser'),
    ([('/robot/arm', 'joints'), AMCL], 'one of /amcl, /robot/arm/joints'),
    ([AMCL, AMCL], '/amcl'),
    ([UNNAMED], NOBODY),
    ([AMCL, UNNAMED], NOBODY),
])
def test_candidates_are_named(graph, case):
    graph.publishers, name = case
    assert PublisherNames(graph, '/tf').name() == name


def test_known_name_is_asked_for_once_a_second_while_ros_runs(graph, clock, who):
    for _ in range(100):
        assert who.name() == '/amcl'
        clock.now += 0.0099
    assert graph.asked == 1
    clock.now += 0.02
    graph.publishers.append(SLAM)
    assert who.name() == 'one of /amcl, /slam'
    graph.publishers.clear()
    clock.now += 1.1
    assert who.name() == NOBODY
    graph.publishers = [AMCL]
    clock.now += 0.1
    assert who.name() == '/amcl', 'a missing name is asked for again soon'
    graph.context.handle.running = False
    clock.now += 10.0
    assert who.name() == '/amcl'
    assert graph.asked == 4


def test_name_that_is_about_to_be_reported_is_asked_for_again(graph, clock, who):
    odd = [Incident(Kind.LOOP, 'map', 'odom', 1, who.name(), 'because')]
    for _ in range(1000):
        assert who.correct([]) == []
    assert graph.asked == 1
    graph.publishers.append(SLAM)
    assert who.correct(odd) == [replace(odd[0], authority='one of /amcl, /slam')]
    assert who.name() == 'one of /amcl, /slam'
    for _ in range(1000):
        who.correct(odd)
        clock.now += 0.001
    assert graph.asked <= 1 + 21, 'a flood of what is told does not flood the graph'


# --- the names of edges

@pytest.fixture
def watched(graph, clock):
    """Receive messages of /tf without DDS; return the reported publishers of an edge."""
    callbacks, graph.executor = [], None
    graph.create_subscription = lambda kind, topic, callback, *_, **__: callbacks.append(callback)
    buffer, doctor = Buffer(), Doctor()
    buffer.observers.add(doctor)
    TransformFeed(buffer, graph, '/tf', False, 10, as_published, Spinner(buffer, graph))

    def hear(parent, child):
        message = TFMessage(transforms=[transform(parent, child, clock.now)])
        callbacks[-1](serialize_message(message), {'publication_sequence_number': None})
        return next((one.publishers for one in doctor.signs() if one.child == child), None)

    return hear


def test_edge_has_the_name_of_those_who_may_have_sent_it(graph, clock, watched):
    both = ('one of /amcl, /wheels',)
    assert watched('map', 'odom') == ('/amcl',)
    clock.now += 0.1
    assert watched('odom', 'early') == ('/amcl',), 'the graph may know its publisher later'
    clock.now += 0.1
    graph.publishers.append(WHEELS)
    assert watched('odom', 'base') == both, 'not of the one that was alone before'
    clock.now += 1.1
    assert watched('map', 'odom') == watched('odom', 'early') == both
    graph.publishers = [WHEELS]
    clock.now += 1.1
    assert watched('odom', 'early') == ('/wheels',), 'the only remaining publisher has sent it'


def test_second_publisher_is_among_those_named_in_its_first_refusal(graph, watched, log):
    """Although the graph was read just before."""
    watched('map', 'odom')
    graph.publishers.append(SLAM)
    watched('odom', 'map')
    until(lambda: "Refused transform 'odom' -> 'map' from 'one of /amcl, /slam'" in log())
    assert "kept: 'map' -> 'odom' from '/amcl'" in log()
