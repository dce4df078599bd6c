# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The status of edges on /diagnostics."""

import queue
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from programs import completed, executable, Program, without
import pytest
from ros_helpers import at, lasting, PATIENCE_S, simulated_clock, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, Pose, TransformBroadcaster, TransformDiagnostics
from tf_tree_py.nodes.buffer_server import BufferServerNode

SECOND = 10**9
OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE)


def of(status):
    """Return the values of a status."""
    return {value.key: value.value for value in status.values}


class Robot:
    """A buffer whose clock is set by hand, and the diagnostics about it."""

    def __init__(self, node):
        self.clock = simulated_clock()
        self.buffer = Buffer()
        self.buffer.use_clock(self.clock)
        self.show(100.0)
        self.diagnostics = TransformDiagnostics(self.buffer, node)

    def show(self, seconds):
        self.now = seconds
        self.clock.set_ros_time_override(at(seconds))

    def send(self, parent='odom', child='base', late=0.0, **options):
        self.buffer.insert(parent, child, round((self.now - late) * SECOND), Pose(),
                           authority='/wheels', **options)

    def run(self, seconds=1.0, late=0.0, rate=10, **options):
        for _ in range(round(seconds * rate)):
            self.show(round(self.now + 1.0 / rate, 6))
            self.send(late=late, **options)

    def status(self, name=' odom -> base'):
        """Return the level, message and values of one status in a new report."""
        (found,) = [status for status in self.diagnostics.report().status
                    if status.name == f'asking: tf{name}']
        assert found.hardware_id == '/asking'
        return found.level, found.message, of(found)

    def level(self, name=' odom -> base'):
        return self.status(name)[0]


@pytest.fixture
def robot(node):
    # It reports when it is called; no executor spins the node.
    robot = Robot(node)
    yield robot
    robot.diagnostics.close()


# --- one edge

def lose_to_another_parent(robot):
    robot.run()
    robot.buffer.insert('map', 'base', round(robot.now * SECOND), Pose(), authority='/slam')
    robot.send()


def stay_static(robot):
    robot.send('base', 'camera', static=True)
    robot.show(1e6)


WELL = {
    'Authority': '/wheels', 'Samples': '10', 'Arrived': '10', 'Rate (Hz)': '10.000',
    'Delay, mean (s)': '0.050000', 'Delay, worst (s)': '0.050000', 'Skew (s)': '0.000000',
    'Newest stamp (s)': '100.950000000'}


@pytest.mark.parametrize(('happen', 'edge', 'level', 'message', 'expected'), [
    (lambda robot: robot.run(late=0.05), 'odom -> base', OK, '10.000 Hz, from /wheels', WELL),
    (lambda robot: robot.run(late=1.5), 'odom -> base',
     WARN, '10.000 Hz, from /wheels; 1.500 s late',
     {**WELL, 'Delay, mean (s)': '1.500000', 'Delay, worst (s)': '1.500000',
      'Newest stamp (s)': '99.500000000'}),
    (lambda robot: robot.run(late=-1.5), 'odom -> base',
     WARN, '10.000 Hz, from /wheels; stamps are 1.500 s ahead of the clock',
     {**WELL, 'Delay, mean (s)': '-1.500000', 'Delay, worst (s)': '-1.500000',
      'Skew (s)': '1.500000', 'Newest stamp (s)': '102.500000000'}),
    (lambda robot: (robot.run(late=0.05), robot.send(late=30.0)), 'odom -> base',
     WARN, '10.000 Hz, from /wheels; 1 of 11 refused (older than the buffer keeps); 2.773 s late',
     {**WELL, 'Arrived': '11', 'Delay, mean (s)': '2.772727', 'Delay, worst (s)': '30.000000',
      'Refused: older than the buffer keeps': '1'}),
    (lambda robot: (robot.run(late=0.05), robot.send(late=-60.0)), 'odom -> base',
     WARN, '0.164 Hz, from /wheels; odd (ahead of the clock); stamps are 60.000 s ahead of the '
     'clock', {**WELL, 'Samples': '11', 'Arrived': '11', 'Rate (Hz)': '0.164',
               'Delay, mean (s)': '-5.409091', 'Skew (s)': '60.000000',
               'Newest stamp (s)': '161.000000000', 'Odd: ahead of the clock': '1'}),
    (stay_static, 'base -> camera', OK, 'static, from /wheels',
     {'Authority': '/wheels', 'Samples': '1'}),
    (lambda robot: (robot.run(), robot.send('base', 'odom')), 'base -> odom',
     ERROR, 'not in the tree: 1 refused (would close a loop)',
     {'Arrived': '1', 'Refused: would close a loop': '1'}),
    (lose_to_another_parent, 'map -> base',
     WARN, 'not in the tree any more (two publishers, two parents)',
     {'Arrived': '1', 'Odd: two publishers, two parents': '1'}),
], ids=['well', 'late', 'ahead', 'refused', 'odd', 'static', 'never let in', 'between parents'])
def test_report_describes_each_edge(robot, happen, edge, level, message, expected):
    happen(robot)
    assert robot.status(f' {edge}') == (level, message, expected)


def test_edge_without_a_name_is_counted_and_gets_no_status(robot):
    robot.run()
    robot.send(child='')
    assert [status.name for status in robot.diagnostics.report().status] == [
        'asking: tf', 'asking: tf odom -> base']


def test_status_is_that_of_the_time_since_the_last_report(robot):
    robot.run(late=0.9)
    robot.send(late=0.95)
    assert robot.status()[2]['Delay, worst (s)'] == '0.950000'
    robot.run(late=0.1)
    _, _, values = robot.status()
    assert (values['Delay, worst (s)'], values['Arrived']) == ('0.100000', '10')

    robot.run(late=30.0)
    assert robot.status()[:2] == (ERROR, 'all 10 refused (older than the buffer keeps)')
    robot.run()
    # The clock of a paused simulation stands still, which is no silence.
    assert {robot.level() for _ in range(5)} == {OK}

    robot.show(robot.now + 1.0)
    assert robot.level() == OK
    robot.show(robot.now + 4.0)
    level, message, values = robot.status()
    assert (level, message) == (STALE, 'silent for 5.000 s; the last sample came from /wheels')
    assert values['Arrived'] == '0'
    robot.run()
    assert robot.level() == OK

    robot.show(10.0)
    names = [status.name for status in robot.diagnostics.report().status]
    assert names == ['asking: tf'], 'nothing is stored after a jump back'
    robot.run()
    assert robot.level() == OK


def test_edge_that_comes_seldom_is_given_time(robot):
    robot.run(30.0, rate=0.2)
    robot.status()
    robot.show(robot.now + 14.0)
    assert robot.level() == OK
    robot.show(robot.now + 2.0)
    assert robot.level() == STALE


def test_source_that_made_way_is_shown_until_it_answers_again(robot):
    def sends(source):
        robot.buffer.insert_from(source, 'odom', 'base', round(robot.now * SECOND), Pose())

    sends('wheels')
    sends('visual')
    robot.buffer.switch_by_rule('base', max_age=SECOND // 2)
    robot.show(101.0)
    for sentence in ("'wheels' was replaced (source fell silent)", "'wheels' was replaced"):
        sends('visual')
        level, message, values = robot.status()
        assert level == WARN and sentence in message
        assert values['Authority'] == 'visual'
    assert 'nothing for more than 500 ms' in values['Made way: wheels']
    sends('wheels')
    robot.buffer.switch('base', to='wheels')
    level, _, values = robot.status()
    assert level == OK and 'Made way: wheels' not in values


# --- all edges

def test_buffer_counts_what_came_since_the_last_report(robot):
    assert robot.status('')[:2] == (OK, '0 frames, 0 transforms taken')
    robot.run()
    assert robot.status('')[:2] == (OK, '2 frames, 10 transforms taken')
    robot.run()
    robot.send(late=30.0)
    robot.send('', 'base')
    assert robot.status('') == (
        WARN, '2 frames, 10 transforms taken, 2 refused '
        '(empty frame name, older than the buffer keeps)', {
            'Frames': '2', 'Taken': '10', 'Refused': '2', 'Taken, in all': '20',
            'Refused, in all': '2', 'Refused, in all: older than the buffer keeps': '1',
            'Refused, in all: empty frame name': '1'})
    assert [status.name for status in robot.diagnostics.report().status] == [
        'asking: tf', 'asking: tf odom -> base'], 'what has no name is no edge'


def test_tree_in_pieces_is_an_error_until_it_is_one(robot):
    robot.run()
    robot.send('bench', 'tool')
    assert robot.level('') == OK, 'its nodes may be starting'
    for _ in range(3):
        robot.show(robot.now + 6.0)
        level, message, _ = robot.status('')
        assert level == ERROR and 'in 2 pieces, below odom, bench' in message
    robot.send('base', 'bench')
    assert robot.level('') == OK


def test_frame_between_two_parents_is_an_error_until_one_gives_up(robot):
    robot.run()
    for _ in range(3):
        for _ in range(5):
            robot.run(0.1)
            robot.send('map')
        level, message, _ = robot.status('')
        assert level == ERROR and 'base has the parents odom, map' in message
    robot.run()
    assert robot.level('') == ERROR, 'it has changed once more'
    robot.run()
    assert robot.level('') == OK


def test_end_of_ros_in_the_middle_of_a_report_is_no_error(robot, node, context):
    robot.run()
    asked = robot.buffer.edges

    def edges():
        context.shutdown()
        return asked()

    robot.buffer.edges = edges
    (timer,) = node.timers
    timer.callback()
    assert not context.ok()


def test_closing_twice_is_harmless_and_ends_the_counting(robot):
    robot.diagnostics.close()
    robot.diagnostics.close()
    robot.send()
    assert robot.status()[2]['Arrived'] == '0'


# --- over DDS

@pytest.fixture
def published(make_node, spin):
    """Subscribe to /diagnostics."""
    messages = queue.Queue()
    hearing = make_node('hearing')
    hearing.create_subscription(DiagnosticArray, '/diagnostics', messages.put, 10)
    spin(hearing)
    return messages


def wait_for_status(messages, is_meant):
    """Return the first status for which a function is true."""
    found = []

    def came():
        found.extend(filter(is_meant, messages.get(timeout=PATIENCE_S).status))
        return found

    until(came)
    return found[0]


def test_subscriber_hears_of_every_edge(node, spin, published, listen, talker):
    buffer = listen(node)
    spin(node)
    with TransformDiagnostics(buffer, node, lasting(0.02)):
        talker.fix(transform('base', 'camera'))
        talker.move(transform('odom', 'base', 5.0))
        edge = wait_for_status(published, lambda status: status.name == 'asking: tf odom -> base')
        assert of(edge)['Newest stamp (s)'] == '5.000000000'
        wait_for_status(published, lambda status: status.message == 'static, from /talking')
        wait_for_status(published, lambda status: 'from /talking' in status.message
                        and status.level == STALE)
    until(lambda: node.count_publishers('/diagnostics') == 0)


def test_buffer_server_publishes_if_a_parameter_says_so(published, talker, context):
    program = Program(*executable(
        'buffer_server', '--ros-args', '-p', 'diagnostics:=true', '-p', 'max_future:=1.0'))
    try:
        talker.move(transform('odom', 'base', 2**31 - 1))
        status = wait_for_status(
            published, lambda status: 'Refused, in all: too far in the future' in of(status))
        assert (status.name, status.hardware_id) == ('tf_buffer: tf', '/tf_buffer')
    finally:
        program.kill()
    by_default = BufferServerNode(context=context)
    topics = {publisher.topic_name for publisher in by_default.publishers}
    by_default.destroy_node()
    assert '/parameter_events' in topics and '/diagnostics' not in topics


def test_bad_parameter_and_missing_messages_are_one_sentence_each():
    done = completed(sys.executable, '-c', WITHOUT_DIAGNOSTIC_MSGS)
    of_package, *of_server = done.stderr.splitlines()
    assert of_package.startswith(
        'tf_tree_py.TransformDiagnostics needs ROS 2, and diagnostic_msgs is not installed')
    assert of_server == [
        "buffer_server: parameter diagnostics must be true or false, not 'sometimes'",
        'buffer_server: parameter diagnostics: diagnostic_msgs is not installed']
    assert done.stdout.split() == ['2', '2']


WITHOUT_DIAGNOSTIC_MSGS = without('diagnostic_msgs') + """
import sys
import tf_tree_py
from tf_tree_py.nodes.buffer_server import main
tf_tree_py.Buffer()
try:
    tf_tree_py.TransformDiagnostics
except ImportError as error:
    print(error, file=sys.stderr)
for given in ('sometimes', 'true'):
    print(main(['buffer_server', '--ros-args', '-p', f'diagnostics:={given}']))
"""


def test_fault_of_a_publisher_is_an_error_until_it_leaves(make_node, node, listen):
    """Of two publishers no second report arrives, but no report of the end of one either."""
    buffer = listen(node)
    fighters = [make_node(name) for name in ('wheels', 'visual')]
    senders = [TransformBroadcaster(fighter) for fighter in fighters]
    # It is volatile, so that a listener that comes later hears nothing.
    fighters[1].create_publisher(TFMessage, '/tf_static', 10)
    with TransformDiagnostics(buffer, node) as diagnostics:
        def faults():
            for sender in senders:
                now = node.get_clock().now().nanoseconds
                sender.sendTransform(transform('odom', 'base', now / SECOND))
            whole, *edges = diagnostics.report().status
            volatile = whole.level == ERROR and '/visual publishes /tf_static' in whole.message
            return max((edge.level for edge in edges), default=OK), volatile

        until(lambda: faults() == (ERROR, True))
        # On a busy machine, the edge may be silent for a moment.
        assert {faults() for _ in range(20)} <= {(ERROR, True), (STALE, True)}
        senders.pop()
        fighters[1].destroy_node()
        until(lambda: faults() in [(OK, False), (WARN, False)])
