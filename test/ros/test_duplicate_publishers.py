# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two publishers of one edge are detected over real DDS, and similar situations are not."""

import itertools
import time

from hand_clock import HandClock
from inputs import for_each
from programs import executable, Program
import pytest
from ros_helpers import at, transform, until
from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.core import Kind
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.ros.topics.endpoints import DuplicatePublishers


def reported(buffer):
    return buffer.statistics().incidents[Kind.TWO_PUBLISHERS]


@pytest.fixture(autouse=True)
def short_lease(monkeypatch):
    monkeypatch.setattr('tf_tree_py.ros.topics.endpoints.LEASE_S', 1.0)


@pytest.fixture
def log(log):
    """Return the lines that were logged about two publishers."""
    return lambda: [line for line in log().splitlines()
                    if Kind.TWO_PUBLISHERS.value in line]


@pytest.fixture(params=[True, False], ids=['own thread', 'on the node'])
def buffer(request, node, listen, spin, use_wait_set):
    """Listen on a node in each of the available ways."""
    spin(node)
    return listen(node, spin_thread=request.param)


@pytest.fixture
def broadcaster(make_node):
    """Return a function that creates a broadcaster on a new node, and waits for a listener."""
    def make(name, cls=TransformBroadcaster):
        made = cls(make_node(name))
        until(made.pub_tf.get_subscription_count)
        return made

    return make


def send_in_turns(buffer, senders, until_true):
    """Let each broadcaster send its next message, until a condition holds."""
    seconds = itertools.count(1.0, 0.01)

    def send():
        for broadcaster, edges in senders:
            second = next(seconds)
            broadcaster.sendTransform([transform(*edge, second) for edge in edges])
            # One after the other, like robots; a slow receiver would lose messages of a burst.
            stamp = at(second).nanoseconds
            until(lambda stamp=stamp: any(edge.latest >= stamp for edge in buffer.edges()))
        return until_true()

    until(send)


ODOM, ARM, TOOL = ('odom', 'base'), ('base', 'arm'), ('arm', 'tool')


# --- two publishers

def test_edge_of_two_nodes_is_logged_once_with_both_names(node, buffer, broadcaster, log):
    one, other = broadcaster('wheels'), broadcaster('visual')
    more_rounds = itertools.count()
    send_in_turns(buffer, [(one, [ODOM, ARM]), (other, [ODOM]), (other, [TOOL])],
                  lambda: reported(buffer) and next(more_rounds) == 50)
    assert reported(buffer) == 1
    (line,) = log()
    assert "Note on transform 'odom' -> 'base' from 'one of /visual, /wheels'" in line
    assert 'both /visual and /wheels send it' in line
    assert buffer.statistics().refused == 0


def test_static_edge_of_two_nodes_is_logged(node, buffer, broadcaster, log):
    one = broadcaster('calibration', StaticTransformBroadcaster)
    one.sendTransform([transform(*ARM), transform(*TOOL)])
    until(lambda: buffer.statistics().accepted == 2)
    other = broadcaster('urdf', StaticTransformBroadcaster)
    until(lambda: node.count_publishers('/tf_static') == 2)
    other.sendTransform([transform(*TOOL), transform(*ODOM)])
    until(lambda: buffer.statistics().accepted == 4)
    assert not reported(buffer), 'one of them may have left before, as far as is known'
    # On the node there is no thread that looks later, without a message.
    until(lambda: one.sendTransform(transform(*ARM)) or reported(buffer))
    accepted = buffer.statistics().accepted
    other.sendTransform(transform(*ODOM))
    until(lambda: buffer.statistics().accepted > accepted)
    (line,) = log()
    assert "'arm' -> 'tool'" in line
    assert 'both /calibration and /urdf send it' in line
    assert reported(buffer) == 1


def test_short_lived_nodes_that_follow_each_other_are_no_rivals_of_a_third(
        make_node, buffer, broadcaster, log):
    """The graph, which is not read all the time, may never have shown the first of them."""
    robot = broadcaster('robot_state_publisher', StaticTransformBroadcaster)
    robot.sendTransform(transform('base', 'camera'))
    until(lambda: buffer.statistics().accepted == 1)
    for number in range(6):
        changer = make_node('tool_changer')
        tool = StaticTransformBroadcaster(changer)
        for x in (1.0, 2.0):
            tool.sendTransform(transform('arm', 'tool', x=number + x))
            until(lambda x=x, number=number: ('arm', 'tool') in [
                edge[:2] for edge in buffer.edges()] and buffer.lookup(
                    'arm', 'tool').x == number + x)
        changer.destroy_node()
    # Also a second later, when the last two would be known to be rivals.
    end = time.monotonic() + 2.5
    until(lambda: robot.sendTransform(transform('base', 'camera')) or time.monotonic() > end)
    assert log() == []


def test_two_programs_of_the_same_name(node, listen, log):
    """The most common cause: a program was started twice."""
    buffer = listen(node)
    programs = [Program(*executable('five_frame_publisher')) for _ in range(2)]
    try:
        moving = {('world', 'odom'), ('odom', 'base_link'), ('base_link', 'gripper')}
        until(lambda: reported(buffer) >= len(moving))
        taken = buffer.statistics().accepted
        until(lambda: buffer.statistics().accepted > taken + 10)
        # One edge has a line, and the others are in the count that follows.
        until(lambda: len(log()) == 2)
        line, others = log()
        assert 'two publishers of /five_frame_publisher send it' in line
        assert all('{!r} -> {!r}'.format(*edge) in line + others for edge in moving)
        assert reported(buffer) == len(moving)
    finally:
        for program in programs:
            program.interrupt()
        for program in programs:
            program.end()


# --- one publisher

@pytest.mark.parametrize(('cls', 'topic'), [
    (TransformBroadcaster, '/tf'), (StaticTransformBroadcaster, '/tf_static')])
def test_publishers_of_different_edges_are_no_rivals(
        node, make_node, listen, broadcaster, cls, topic):
    """Also if one of them sends everything twice, and is restarted."""
    buffer, sent = listen(node), 0
    beside = broadcaster('beside', cls)
    for _ in range(6):
        again = make_node('again')
        one = cls(again)
        until(one.pub_tf.get_subscription_count)
        for _ in range(20):
            for each, edges in ((one, [ODOM]), (one, [ODOM]), (beside, [ARM, TOOL])):
                each.sendTransform([transform(*edge, 1.0 + sent) for edge in edges])
                sent += len(edges)
                until(lambda sent=sent: buffer.statistics().accepted >= sent)
        again.destroy_node()
        until(lambda: node.count_publishers(topic) == 1)
    assert reported(buffer) == 0


# --- with graphs that cannot be produced with real nodes

class Graph:
    """A node whose view of the graph the test chooses."""

    def __init__(self, *names):
        self.show(*names)
        self.now = None

    def show(self, *names, as_of=0):
        self.names = sorted(names)
        self.endpoints = frozenset(f'{name}{as_of}{place}'.encode()
                                   for place, name in enumerate(names))

    def ask(self):
        if self.now is not None:
            self.show(*self.now, as_of=1)

    def name(self):
        return 'one of ' + ', '.join(self.names)


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr('tf_tree_py.ros.topics.endpoints.time', clock)
    return clock


def follow(rivals, *numbers):
    batch = Batch([('/odom', '/base')], [1], [b''])
    return [incident for number in numbers
            for incident in rivals.judge(batch, {'publication_sequence_number': number})]


IN_TURNS = [number + begin for number in range(10) for begin in (1, 100)]


@for_each(case=[
    (['/a'], False, IN_TURNS, None),
    (['/a', '/b'], False, [None] * 100, None),
    (['/a', '/b'], False, IN_TURNS, 'both /a and /b send it'),
    (['/a', '/a'], False, IN_TURNS, 'two publishers of /a send it'),
    (['/a', '/b', '/c'], False, IN_TURNS, 'two of /a, /b, /c send it'),
    # A crashed node of a static edge, and its successor.
    (['/a', '/a'], True, [1, 1], None),
])
def test_two_are_reported_if_the_graph_and_the_numbers_show_them(clock, case):
    names, static, numbers, words = case
    rivals = DuplicatePublishers(Graph(*names), static)
    incidents = follow(rivals, *numbers)
    clock.now += 1.0
    incidents += rivals.settled()
    assert [(each.parent, each.child) for each in incidents] == ([ODOM] if words else [])
    assert all(words in incident.detail for incident in incidents)


def test_publisher_that_turns_out_to_have_left_was_restarted(clock):
    graph = Graph('/a', '/b')
    rivals = DuplicatePublishers(graph, True)
    assert follow(rivals, 5, 1) == []
    graph.now = ['/c', '/b']
    clock.now += 1.0
    assert rivals.settled() == [] == follow(rivals, 1)
    graph.now = None
    clock.now += 1.0
    assert follow(rivals, 2, 1) == []
    clock.now += 0.5
    assert rivals.settled() == [] == follow(rivals, 1)
    clock.now += 0.5
    (report,) = rivals.settled()
    assert report.kind is Kind.TWO_PUBLISHERS
    assert rivals.settled() == [] == follow(rivals, 2, 1)


def test_static_edge_of_a_publisher_whose_end_becomes_known_later_is_not_reported(clock):
    rivals = DuplicatePublishers(Graph('/a', '/b'), True)
    assert follow(rivals, 5, 1) == []
    clock.now += 0.5
    rivals.forget_for_a_while()
    clock.now += 0.7
    # A message that was on its way may be of the one that left.
    assert follow(rivals, 6) == [] == rivals.settled()
    clock.now += 0.4
    assert follow(rivals, 1) == []
    clock.now += 1.0
    assert rivals.settled() == []


@for_each(static=[False, True])
def test_numbers_of_a_publisher_that_has_left_count_no_more(static):
    graph = Graph('/a', '/b')
    rivals = DuplicatePublishers(graph, static)
    for run in range(20):
        graph.show('/a', '/b', as_of=run)
        assert follow(rivals, 7, 8, 9) == []


def test_rivals_are_reported_as_soon_as_both_names_are_known():
    graph = Graph('/a', '/b')
    names, graph.names = graph.names, []
    rivals = DuplicatePublishers(graph, False)
    assert follow(rivals, *IN_TURNS) == []
    graph.names = names
    assert len(follow(rivals, *[number + 100 for number in IN_TURNS])) == 1
