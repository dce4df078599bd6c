# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two publishers of one edge are detected over real DDS, and similar situations are not."""

import itertools
import signal
import subprocess
import sys

import pytest
from ros_helpers import PATIENCE_S, transform, until
from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.core import Kind
from tf_tree_py.core.ingest.sample import Batch
from tf_tree_py.ros.threads import receiver as receiver_module
from tf_tree_py.ros.topics.duplicate_publishers import DuplicatePublishers


def told(buffer):
    return buffer.statistics().incidents[Kind.TWO_PUBLISHERS]


@pytest.fixture
def log(log):
    """Return the lines that were logged about two publishers."""
    return lambda: [line for line in log().splitlines()
                    if Kind.TWO_PUBLISHERS.value in line]


@pytest.fixture(params=['wait set', 'executor', 'on the node'])
def begin(request, listen, spin, monkeypatch):
    """Listen on a node in each of the available ways."""
    def listen_so(node):
        if request.param == 'on the node':
            spin(node)
            return listen(node, spin_thread=False)
        monkeypatch.setitem(receiver_module.Receiver.__init__.__kwdefaults__, 'use_wait_set',
                            request.param == 'wait set')
        return listen(node)

    return listen_so


@pytest.fixture
def broadcaster(make_node):
    """Return a function that creates a broadcaster on a new node."""
    def make(name, kind=TransformBroadcaster):
        return kind(make_node(name))
    return make


def until_heard(*broadcasters, listeners=1):
    for each in broadcasters:
        until(lambda each=each: each.pub_tf.get_subscription_count() >= listeners)


def send_in_turns(buffer, senders, until_true):
    """Let each broadcaster send its next message, until a condition holds."""
    # Stamps that continue from the received ones.
    newest = max((edge.latest for edge in buffer.edges()), default=0)
    seconds = itertools.count(1.0 + newest / 1e9, 0.01)

    def send():
        for broadcaster, edges in senders:
            second = next(seconds)
            broadcaster.sendTransform([transform(*edge, second) for edge in edges])
            # One after the other, like robots; a slow receiver would lose messages of a burst.
            until(lambda second=second: _has_come(buffer, second))
        return until_true()

    until(send)


def _has_come(buffer, second):
    return any(edge.latest >= round(second * 1e9) for edge in buffer.edges())


ODOM, ARM, TOOL = ('odom', 'base'), ('base', 'arm'), ('arm', 'tool')


# --- two publishers

def test_edge_of_two_nodes_is_told_once_and_names_both(node, begin, broadcaster, log):
    buffer = begin(node)
    one, other = broadcaster('wheels'), broadcaster('visual')
    until_heard(one, other)
    senders = [(one, [ODOM, ARM]), (other, [ODOM]), (other, [TOOL])]
    send_in_turns(buffer, senders, lambda: told(buffer))
    for _ in range(50):
        send_in_turns(buffer, senders, lambda: True)
    assert told(buffer) == 1
    (line,) = log()
    assert "Note on transform 'odom' -> 'base' from 'one of /visual, /wheels'" in line
    assert 'both /visual and /wheels send it' in line
    assert buffer.statistics().refused == 0


def test_one_of_several_publishers_is_named_as_such(node, listen, broadcaster, log):
    buffer = listen(node)
    senders = [(broadcaster('wheels'), [ODOM]), (broadcaster('visual'), [ODOM]),
               (broadcaster('arm'), [ARM])]
    until_heard(*[each for each, _ in senders])
    send_in_turns(buffer, senders, lambda: told(buffer))
    send_in_turns(buffer, senders, lambda: True)
    (line,) = log()
    assert 'two of /arm, /visual, /wheels send it' in line


def test_static_edge_of_two_nodes_is_told(node, begin, broadcaster, log):
    buffer = begin(node)
    one = broadcaster('calibration', StaticTransformBroadcaster)
    one.sendTransform([transform(*ARM), transform(*TOOL)])
    until(lambda: buffer.statistics().accepted == 2)
    other = broadcaster('urdf', StaticTransformBroadcaster)
    until(lambda: node.count_publishers('/tf_static') == 2)
    other.sendTransform([transform(*TOOL), transform(*ODOM)])
    until(lambda: buffer.statistics().accepted == 4)
    until(lambda: told(buffer))
    one.sendTransform(transform(*ARM))
    other.sendTransform(transform(*ODOM))
    until(lambda: buffer.statistics().accepted == 8)
    (line,) = log()
    assert "'arm' -> 'tool'" in line
    assert 'both /calibration and /urdf send it' in line
    assert told(buffer) == 1


def test_two_programs_of_the_same_name(node, listen, log):
    """The most common cause: a program was started twice."""
    buffer = listen(node)
    command = [sys.executable, '-m', 'tf_tree_py.nodes.five_frame_publisher']
    programs = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for _ in range(2)]
    try:
        moving = {('world', 'odom'), ('odom', 'base_link'), ('base_link', 'gripper')}
        until(lambda: told(buffer) >= len(moving))
        taken = buffer.statistics().accepted
        until(lambda: buffer.statistics().accepted > taken + 10)
        lines = log()
        for edge in moving:
            (line,) = [line for line in lines if '{!r} -> {!r}'.format(*edge) in line]
            assert 'two publishers of /five_frame_publisher send it' in line
        assert told(buffer) == len(moving)
    finally:
        for program in programs:
            program.send_signal(signal.SIGINT)
        for program in programs:
            program.wait(PATIENCE_S)


# --- one publisher

@pytest.mark.parametrize('kind', ['moving', 'static'])
def test_publishers_of_different_edges_are_no_rivals(node, listen, broadcaster, kind):
    buffer = listen(node)
    make = StaticTransformBroadcaster if kind == 'static' else TransformBroadcaster
    one, other = broadcaster('wheels', make), broadcaster('visual', make)
    until_heard(one, other)
    for number in range(1, 101):
        for each, edges in ((one, [ODOM]), (other, [ARM, TOOL])):
            each.sendTransform([transform(*edge, float(number)) for edge in edges])
        until(lambda number=number: buffer.statistics().accepted >= 3 * number)
    assert told(buffer) == 0


@pytest.mark.parametrize('kind', [TransformBroadcaster, StaticTransformBroadcaster])
def test_node_that_is_restarted_is_no_rival(node, make_node, listen, broadcaster, kind):
    buffer, sent = listen(node), 0
    beside = broadcaster('beside', kind)
    for _ in range(6):
        again = make_node('again')
        one = kind(again)
        until_heard(one, beside)
        for _ in range(3):
            one.sendTransform(transform(*ODOM, 1.0 + sent))
            beside.sendTransform(transform(*ARM, 1.0 + sent))
            sent += 2
            until(lambda sent=sent: buffer.statistics().accepted == sent)
        again.destroy_node()
        until(lambda: node.count_publishers(one_topic(kind)) == 1)
    assert told(buffer) == 0


def one_topic(kind):
    return '/tf' if kind is TransformBroadcaster else '/tf_static'


def test_publisher_that_sends_everything_twice_is_no_rival(node, listen, make_node, broadcaster):
    buffer = listen(node)
    one, beside = broadcaster('wheels'), broadcaster('arm')
    until_heard(one, beside)
    for number in range(1, 101):
        for _ in range(2):
            one.sendTransform(transform(*ODOM, float(number)))
        beside.sendTransform(transform(*ARM, float(number)))
        until(lambda number=number: buffer.statistics().accepted == 3 * number)
    assert told(buffer) == 0


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


def follow(rivals, *numbers, edges=(ODOM,)):
    batch = Batch(list(edges), [1] * len(edges), [b''] * len(edges))
    return [incident for number in numbers
            for incident in rivals.judge(batch, {'publication_sequence_number': number})]


IN_TURNS = [number + begin for number in range(10) for begin in (1, 100)]


def test_single_publisher_is_none_whatever_the_numbers():
    assert follow(DuplicatePublishers(Graph('/a'), False), *IN_TURNS) == []


def test_middleware_without_numbers_tells_nothing():
    assert follow(DuplicatePublishers(Graph('/a', '/b'), False), *[None] * 100) == []


def test_who_turns_out_to_have_left_was_restarted():
    graph = Graph('/a', '/b')
    rivals = DuplicatePublishers(graph, True)
    assert follow(rivals, 5) == []
    graph.now = ['/c', '/b']
    assert follow(rivals, 1) == []
    graph.now = None
    assert follow(rivals, 2) == []
    (told_now,) = follow(rivals, 1)
    assert told_now.kind is Kind.TWO_PUBLISHERS


@pytest.mark.parametrize('static', [False, True])
def test_numbers_of_who_has_left_count_no_more(static):
    graph = Graph('/a', '/b')
    rivals = DuplicatePublishers(graph, static)
    for run in range(20):
        graph.show('/a', '/b', as_of=run)
        assert follow(rivals, 7, 8, 9) == []


def test_static_edge_of_a_crashed_node_and_its_successor_is_not_told():
    assert follow(DuplicatePublishers(Graph('/a', '/a'), True), 1, 1) == []
    assert len(follow(DuplicatePublishers(Graph('/a', '/a'), False), *IN_TURNS)) == 1


def test_while_a_name_is_missing_it_is_not_told_and_then_it_is():
    graph = Graph('/a', '/b')
    names, graph.names = graph.names, []
    rivals = DuplicatePublishers(graph, False)
    assert follow(rivals, *IN_TURNS) == []
    graph.names = names
    assert len(follow(rivals, *[number + 100 for number in IN_TURNS])) == 1


def test_frames_with_slashes_are_named_as_in_the_buffer():
    (incident,) = follow(DuplicatePublishers(Graph('/a', '/b'), False), *IN_TURNS,
                         edges=[('/odom', '/base')])
    assert (incident.parent, incident.child) == ODOM
