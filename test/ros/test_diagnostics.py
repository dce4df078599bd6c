# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The status of edges on /diagnostics."""

from collections.abc import Callable
import queue
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
from rclpy.clock import ROSClock
from ros_helpers import at, lasting, PATIENCE_S, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, Pose, TransformBroadcaster, TransformDiagnostics

SECOND = 10**9
OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE)


class Robot:
    """A buffer whose clock is set by hand, and the diagnostics about it."""

    def __init__(self, node):
        self.clock = ROSClock()
        self.clock._set_ros_time_is_active(True)
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
        """Return one status of a new report, and its values."""
        (found,) = [status for status in self.diagnostics.report().status
                    if status.name == f'asking: tf{name}']
        return found, {value.key: value.value for value in found.values}


@pytest.fixture
def robot(node):
    # It reports when it is called; no executor spins the node.
    robot = Robot(node)
    yield robot
    robot.diagnostics.close()


# --- one edge

def test_edge_that_is_well(robot):
    robot.run(late=0.05)
    status, values = robot.status()
    assert status.level == OK
    assert status.message == '10.000 Hz, from /wheels'
    assert status.hardware_id == '/asking'
    assert values == {
        'Authority': '/wheels', 'Samples': '10', 'Arrived': '10', 'Rate (Hz)': '10.000',
        'Delay, mean (s)': '0.050000', 'Delay, worst (s)': '0.050000', 'Skew (s)': '0.000000',
        'Newest stamp (s)': '100.950000000'}


def test_source_that_made_way_is_shown_until_it_answers_again(robot):
    def sends(source):
        robot.buffer.insert_from(source, 'odom', 'base', round(robot.now * SECOND), Pose())

    sends('wheels')
    sends('visual')
    robot.buffer.switch_by_rule('base', max_age=SECOND // 2)
    robot.show(101.0)
    sends('visual')
    status, values = robot.status()
    assert status.level == WARN and "'wheels' was replaced (source fell silent)" in status.message
    assert values['Authority'] == 'visual'
    sends('visual')
    status, values = robot.status()
    assert status.level == WARN and "'wheels' was replaced" in status.message
    assert 'nothing for more than 500 ms' in values['Made way: wheels']
    sends('wheels')
    robot.buffer.switch('base', to='wheels')
    status, values = robot.status()
    assert status.level == OK and 'Made way: wheels' not in values


def test_delays_are_those_since_the_last_report(robot):
    robot.run(late=0.9)
    robot.send(late=0.95)
    assert robot.status()[1]['Delay, worst (s)'] == '0.950000'
    robot.run(late=0.1)
    values = robot.status()[1]
    assert (values['Delay, worst (s)'], values['Arrived']) == ('0.100000', '10')


def test_late_edge_is_warned_of(robot):
    robot.run(late=1.5)
    status, _ = robot.status()
    assert status.level == WARN
    assert status.message == '10.000 Hz, from /wheels; 1.500 s late'


def test_clock_that_is_ahead_is_warned_of(robot):
    robot.run(late=-1.5)
    status, values = robot.status()
    assert status.level == WARN
    assert 'stamps are 1.500 s ahead of the clock' in status.message
    assert values['Skew (s)'] == '1.500000'
    assert values['Delay, mean (s)'] == '-1.500000'


def test_some_refusals_are_warned_of_and_counted_by_kind(robot):
    robot.run()
    robot.send(late=30.0)
    status, values = robot.status()
    assert status.level == WARN
    assert '1 of 11 refused (older than the buffer keeps)' in status.message
    assert values['Refused: older than the buffer keeps'] == '1'
    robot.run()
    assert robot.status()[0].level == OK, 'it is over'


def test_remarks_are_warned_of(robot):
    robot.run()
    robot.send(late=-60.0)
    status, values = robot.status()
    assert status.level == WARN
    assert 'odd (ahead of the clock)' in status.message
    assert values['Odd: ahead of the clock'] == '1'


def test_edge_of_which_all_is_refused_is_an_error(robot):
    robot.run()
    robot.status()
    robot.run(late=30.0)
    status, _ = robot.status()
    assert status.level == ERROR
    assert status.message == 'all 10 refused (older than the buffer keeps)'


def test_silent_edge_is_stale(robot):
    robot.run()
    robot.status()
    robot.show(robot.now + 1.0)
    assert robot.status()[0].level == OK
    robot.show(robot.now + 4.0)
    status, values = robot.status()
    assert status.level == STALE
    assert status.message == 'silent for 5.000 s; the last sample came from /wheels'
    assert values['Arrived'] == '0'
    robot.run()
    assert robot.status()[0].level == OK


def test_edge_that_comes_seldom_is_given_time(robot):
    robot.run(30.0, rate=0.2)
    robot.status()
    robot.show(robot.now + 14.0)
    assert robot.status()[0].level == OK
    robot.show(robot.now + 2.0)
    assert robot.status()[0].level == STALE


def test_paused_simulation_is_not_silence(robot):
    robot.run()
    for _ in range(5):
        assert robot.status()[0].level == OK


def test_jump_back_begins_anew(robot):
    robot.run()
    robot.status()
    robot.show(10.0)
    names = [status.name for status in robot.diagnostics.report().status]
    assert names == ['asking: tf'], 'nothing is stored'
    robot.run()
    assert robot.status()[0].level == OK


def test_static_edge_is_well_however_long_it_is_silent(robot):
    robot.send('base', 'camera', static=True)
    robot.show(1e6)
    status, values = robot.status(' base -> camera')
    assert (status.level, status.message) == (OK, 'static, from /wheels')
    assert values == {'Authority': '/wheels', 'Samples': '1'}


def test_edge_that_is_never_let_in_is_an_error(robot):
    robot.run()
    robot.send('base', 'odom')
    status, values = robot.status(' base -> odom')
    assert status.level == ERROR
    assert status.message == 'not in the tree: 1 refused (would close a loop)'
    assert values == {'Arrived': '1', 'Refused: would close a loop': '1'}


def test_edge_that_lost_to_another_parent_is_no_error(robot):
    robot.run()
    robot.buffer.insert('map', 'base', round(robot.now * SECOND), Pose(), authority='/slam')
    robot.send()
    status, values = robot.status(' map -> base')
    assert status.level == WARN
    assert status.message == 'not in the tree any more (two publishers, two parents)'
    assert values == {'Arrived': '1', 'Odd: two publishers, two parents': '1'}


# --- all edges

def test_buffer_counts_what_came_since_the_last_report(robot):
    robot.run()
    status, values = robot.status('')
    assert (status.level, status.message) == (OK, '2 frames, 10 transforms taken')
    robot.run()
    robot.send(late=30.0)
    robot.send('', 'base')
    status, values = robot.status('')
    assert status.level == WARN
    assert status.message == ('2 frames, 10 transforms taken, 2 refused '
                              '(empty frame name, older than the buffer keeps)')
    assert values == {
        'Frames': '2', 'Taken': '10', 'Refused': '2', 'Taken, in all': '20',
        'Refused, in all': '2', 'Refused, in all: older than the buffer keeps': '1',
        'Refused, in all: empty frame name': '1'}


def test_what_has_no_names_is_no_edge(robot):
    robot.send('', 'base')
    assert [status.name for status in robot.diagnostics.report().status] == ['asking: tf']


def test_empty_buffer_is_no_trouble(robot):
    status, _ = robot.status('')
    assert (status.level, status.message) == (OK, '0 frames, 0 transforms taken')


# --- over DDS

@pytest.fixture
def published(make_node, spin):
    """Subscribe to /diagnostics."""
    messages = queue.Queue()
    hearing = make_node('hearing')
    hearing.create_subscription(DiagnosticArray, '/diagnostics', messages.put, 10)
    spin(hearing)
    return messages


def wait_for_status(messages, is_meant: Callable[[DiagnosticStatus], bool]):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        for status in messages.get(timeout=PATIENCE_S).status:
            if is_meant(status):
                return status
    raise AssertionError('it was never published')


def test_subscriber_hears_of_every_edge(node, spin, published, listen, talker):
    buffer = listen(node)
    spin(node)
    with TransformDiagnostics(buffer, node, lasting(0.02)):
        talker.fix(transform('base', 'camera'))
        talker.move(transform('odom', 'base', 5.0))
        edge = wait_for_status(published, lambda status: status.name == 'asking: tf odom -> base')
        values = {value.key: value.value for value in edge.values}
        assert values['Newest stamp (s)'] == '5.000000000'
        wait_for_status(published, lambda status: status.message == 'static, from /talking')
        wait_for_status(published, lambda status: 'from /talking' in status.message
                        and status.level == STALE)
    until(lambda: node.count_publishers('/diagnostics') == 0)


def test_closing_twice_is_harmless_and_ends_the_counting(node):
    buffer = Buffer()
    diagnostics = TransformDiagnostics(buffer, node)
    diagnostics.close()
    diagnostics.close()
    buffer.set_transform(transform('a', 'b'))
    arrived = [value.value for status in diagnostics.report().status for value in status.values
               if value.key == 'Arrived']
    assert arrived == ['0']


@pytest.mark.parametrize('wanted', [True, False])
def test_buffer_server_publishes_if_it_is_told_to(published, wanted, talker):
    program = subprocess.Popen(
        [sys.executable, '-m', 'tf_tree_py.nodes.buffer_server', '--ros-args',
         '-p', f'diagnostics:={str(wanted).lower()}', '-p', 'max_future:=1.0'],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        talker.move(transform('odom', 'base', 2**31 - 1))
        if wanted:
            status = wait_for_status(
                published, lambda status: status.name == 'tf_buffer: tf' and 'Refused, in all: '
                'too far in the future' in [value.key for value in status.values])
            assert status.hardware_id == '/tf_buffer'
        else:
            assert talker.node.count_publishers('/diagnostics') == 0
    finally:
        program.kill()
        program.communicate()


def test_parameter_that_is_neither_true_nor_false_is_refused():
    done = subprocess.run(
        [sys.executable, '-m', 'tf_tree_py.nodes.buffer_server', '--ros-args',
         '-p', 'diagnostics:=sometimes'], capture_output=True, text=True, timeout=PATIENCE_S,
        check=False)
    assert done.returncode == 2
    assert "parameter diagnostics must be true or false, not 'sometimes'" in done.stderr


# --- without its messages

BLOCKER = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name == 'diagnostic_msgs':
            raise ModuleNotFoundError(f'no {name} here', name=name)

sys.meta_path.insert(0, Blocker())
"""


def run_without_diagnostic_msgs(program, *arguments):
    return subprocess.run([sys.executable, '-c', BLOCKER + program, *arguments],
                          capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def test_without_diagnostic_msgs_one_sentence_says_what_to_install():
    done = run_without_diagnostic_msgs('import tf_tree_py; tf_tree_py.Buffer()\n'
                                       'tf_tree_py.TransformDiagnostics')
    assert done.stderr.splitlines()[-1].startswith(
        'ImportError: tf_tree_py.TransformDiagnostics needs ROS 2, and diagnostic_msgs is not '
        'installed')


def test_buffer_server_without_diagnostic_msgs_says_so():
    done = run_without_diagnostic_msgs(
        'from tf_tree_py.nodes.buffer_server import main; sys.exit(main())',
        '--ros-args', '-p', 'diagnostics:=true')
    assert (done.returncode, done.stderr) == (
        2, 'buffer_server: parameter diagnostics: diagnostic_msgs is not installed\n')


def test_end_of_ros_in_the_middle_of_a_report_is_no_error(robot, context):
    robot.run()
    asked = robot.buffer.edges

    def edges():
        context.shutdown()
        return asked()

    robot.buffer.edges = edges
    robot.diagnostics._publish()
    assert not context.ok()


# --- a level lasts as long as its fault

def test_tree_in_pieces_is_an_error_until_it_is_one(robot):
    robot.run()
    robot.send('bench', 'tool')
    assert robot.status('')[0].level == OK, 'its nodes may be starting'
    for _ in range(3):
        robot.show(robot.now + 6.0)
        status, _ = robot.status('')
        assert (status.level, 'in 2 pieces, below odom, bench' in status.message) == (ERROR, True)
    robot.send('base', 'bench')
    assert robot.status('')[0].level == OK


def test_frame_between_two_parents_is_an_error_until_one_gives_up(robot):
    robot.run()
    for _ in range(3):
        for _ in range(5):
            robot.run(0.1)
            robot.send('map')
        status, _ = robot.status('')
        assert status.level == ERROR and 'base has the parents odom, map' in status.message
    robot.run()
    assert robot.status('')[0].level == ERROR, 'it has changed once more'
    robot.run()
    assert robot.status('')[0].level == OK


def test_two_publishers_are_an_error_until_one_leaves(make_node, node, listen):
    """No second report arrives, but no report of its end either."""
    buffer = listen(node)
    fighters = [make_node(name) for name in ('wheels', 'visual')]
    senders = [TransformBroadcaster(fighter) for fighter in fighters]
    with TransformDiagnostics(buffer, node) as diagnostics:
        def level():
            for sender in senders:
                now = node.get_clock().now().nanoseconds
                sender.sendTransform(transform('odom', 'base', now / SECOND))
            return max((status.level for status in diagnostics.report().status
                        if status.name.endswith('odom -> base')), default=OK)

        until(lambda: level() == ERROR)
        # On a busy machine, the edge may be silent for a moment.
        assert {level() for _ in range(20)} <= {ERROR, STALE}
        senders.pop()
        fighters[1].destroy_node()
        until(lambda: level() not in (ERROR, STALE))


def test_volatile_static_publisher_is_an_error_until_it_leaves(make_node, node, listen):
    buffer = listen(node)
    careless = make_node('careless')
    careless.create_publisher(TFMessage, '/tf_static', 10)
    with TransformDiagnostics(buffer, node) as diagnostics:
        def broken():
            whole = diagnostics.report().status[0]
            return whole.level == ERROR and '/careless publishes /tf_static' in whole.message

        until(broken)
        assert broken()
        careless.destroy_node()
        until(lambda: not broken())
