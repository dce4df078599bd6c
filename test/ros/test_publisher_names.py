# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of publishers, including names that the graph does not have yet, without real nodes."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

from hand_clock import HandClock
import pytest
from rclpy.serialization import serialize_message
from rclpy.topic_endpoint_info import TopicEndpointInfo
from ros_helpers import transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, Incident, TransformBroadcaster
from tf_tree_py.core import Kind
from tf_tree_py.core.health.doctor import Doctor
from tf_tree_py.core.ingest.frame_names import as_published
from tf_tree_py.ros.topics import listener, publisher_names
from tf_tree_py.ros.topics.publisher_names import PublisherNames

SECOND = 10**9
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

    def get_publishers_info_by_topic(self, topic):
        assert topic == '/tf'
        self.asked += 1
        return [TopicEndpointInfo(node_namespace=namespace, node_name=name)
                for namespace, name in self.publishers]


@pytest.fixture
def graph():
    return Graph()


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(publisher_names, 'time', clock)
    return clock


@pytest.mark.parametrize(('publishers', 'name'), [
    ([], 'unknown publisher of /tf'),
    ([('/', 'localiser')], '/localiser'),
    ([('/robot', 'localiser')], '/robot/localiser'),
    ([('/robot/arm', 'joints'), ('/', 'amcl')], 'one of /amcl, /robot/arm/joints'),
    ([('/', 'amcl'), ('/', 'amcl')], '/amcl'),
    ([UNNAMED], 'unknown publisher of /tf'),
    ([('/', 'amcl'), UNNAMED], 'unknown publisher of /tf'),
])
def test_candidates_are_named(graph, publishers, name):
    graph.publishers = publishers
    assert PublisherNames(graph, '/tf').name() == name


def test_known_name_is_asked_for_once_a_second(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = PublisherNames(graph, '/tf')
    for _ in range(100):
        assert who.name() == '/amcl'
        clock.now += 0.0099
    assert graph.asked == 1
    clock.now += 0.02
    graph.publishers.append(('/', 'slam'))
    assert who.name() == 'one of /amcl, /slam'


def test_name_that_is_about_to_be_told_is_asked_for_again(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = PublisherNames(graph, '/tf')
    odd = [Incident(Kind.LOOP, 'map', 'odom', 1, who.name(), 'because')]
    graph.publishers.append(('/', 'slam'))
    (told,) = who.correct(odd)
    assert told == replace(odd[0], authority='one of /amcl, /slam')
    assert who.name() == 'one of /amcl, /slam'


def test_flood_of_what_is_told_does_not_flood_the_graph(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = PublisherNames(graph, '/tf')
    odd = [Incident(Kind.LOOP, 'map', 'odom', 1, who.name(), 'because')]
    for _ in range(1000):
        assert who.correct([]) == []
    assert graph.asked == 1
    for _ in range(1000):
        who.correct(odd)
        clock.now += 0.001
    assert graph.asked <= 1 + 21


def test_missing_name_is_asked_for_again_soon(graph, clock):
    graph.publishers = [UNNAMED]
    who = PublisherNames(graph, '/tf')
    assert who.name() == who.placeholder
    graph.publishers = [('/', 'amcl')]
    clock.now += 0.1
    assert who.name() == '/amcl'
    assert graph.asked == 2


def test_publisher_that_is_gone_leaves_no_name(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = PublisherNames(graph, '/tf')
    assert who.name() == '/amcl'
    graph.publishers.clear()
    clock.now += 1.1
    assert who.name() == 'unknown publisher of /tf'


def test_dead_context_is_not_asked(graph, clock):
    graph.publishers = [('/', 'amcl')]
    who = PublisherNames(graph, '/tf')
    assert who.name() == '/amcl'
    graph.context.handle.running = False
    clock.now += 10.0
    assert who.name() == '/amcl'
    assert graph.asked == 1


# --- the names of edges

@pytest.fixture
def watched(graph, clock):
    """Receive messages of /tf without DDS; return the reported publishers of an edge."""
    graph.create_subscription = lambda *_, **__: None
    graph.executor = None
    buffer, doctor = Buffer(), Doctor()
    buffer.observers.add(doctor)
    feed = listener._Feed(buffer, graph, '/tf', False, 10, as_published,
                          listener._Spinner(buffer, graph))

    def hear(parent, child):
        message = TFMessage(transforms=[transform(parent, child, clock.now)])
        feed._receive(serialize_message(message), {'publication_sequence_number': None})
        return next(one.publishers for one in doctor.signs() if one.child == child)

    return hear


def test_new_edge_is_not_said_to_be_of_the_one_that_was_alone_before(graph, clock, watched):
    graph.publishers = [('/', 'amcl')]
    assert watched('map', 'odom') == ('/amcl',)
    clock.now += 0.1
    graph.publishers.append(('/', 'wheels'))
    assert watched('odom', 'base') == ('one of /amcl, /wheels',)
    clock.now += 1.1
    assert watched('map', 'odom') == ('one of /amcl, /wheels',)


def test_name_is_corrected_where_the_graph_knows_the_publisher_later_than_its_messages(
        graph, clock, watched):
    graph.publishers = [('/', 'amcl')]
    watched('map', 'odom')
    clock.now += 0.1
    assert watched('odom', 'base') == ('/amcl',)
    graph.publishers.append(('/', 'wheels'))
    clock.now += 1.1
    assert watched('odom', 'base') == ('one of /amcl, /wheels',)
    graph.publishers = [('/', 'wheels')]
    clock.now += 1.1
    assert watched('odom', 'base') == ('/wheels',), 'the only remaining publisher has sent it'


def test_edge_of_a_node_that_started_later_is_not_said_to_be_another_ones(
        make_node, listen, spin):
    """Start a monitor, then amcl; 1.5 s later, after the lookup of the names, the wheels."""
    watching = make_node('monitor')
    buffer, doctor = Buffer(), Doctor()
    buffer.observers.add(doctor)
    listen(watching, buffer)
    spin(watching)

    def publishers(sender, parent, child):
        now = watching.get_clock().now().nanoseconds / SECOND
        sender.sendTransform(transform(parent, child, now))
        return next((one.publishers for one in doctor.signs() if one.child == child), ())

    amcl = TransformBroadcaster(make_node('amcl'))
    until(lambda: publishers(amcl, 'map', 'odom') == ('/amcl',))
    later = watching.get_clock().now().nanoseconds + 3 * SECOND // 2
    until(lambda: publishers(amcl, 'map', 'odom') == ('/amcl',)
          and watching.get_clock().now().nanoseconds > later)
    wheels = TransformBroadcaster(make_node('wheels'))
    both = ('one of /amcl, /wheels',)
    until(lambda: publishers(wheels, 'odom', 'base') == both)
    assert all(publishers(wheels, 'odom', 'base') == both for _ in range(20))
    until(lambda: publishers(amcl, 'map', 'odom') == both)
