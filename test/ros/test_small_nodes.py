# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The small nodes beside a user's node: their names, options and clock; and who is alive."""

import re
import threading
import weakref

import pytest
import rclpy
from rclpy.context import Context
import rclpy.logging
from rclpy.parameter import Parameter
from ros_helpers import until
from tf_tree_py.ros.threads.internal_node import (
    CallbackFailures,
    internal_node,
    is_alive,
    is_locked_here,
    is_running,
    node_of_its_own,
    qos_overrides_of,
    USE_SIM_TIME,
)

DEPTH = 'qos_overrides./tf.subscription.depth'


def options_of(node):
    """Return what other processes see of a node beside its name."""
    return (node.get_namespace(), sorted(each.srv_name for each in node.services),
            sorted(each.topic_name for each in node.publishers))


@pytest.fixture
def beside(make_node):
    """Return a node with everything that a small node may take over."""
    return make_node('beside', namespace='/robot', cli_args=[
        '--ros-args', '-r', '/clock:=/time', '-r', 'tf:=other_tf'], parameter_overrides=[
            Parameter('use_sim_time', value=True), Parameter(DEPTH, value=7),
            Parameter('another', value=1)])


@pytest.mark.parametrize('options', [{}, {'with_clock': True}])
def test_small_node_is_hidden_and_follows_the_clock_of_the_other(beside, options):
    small, second = (internal_node(beside, 'beside_impl', **options) for _ in range(2))
    try:
        assert re.fullmatch(r'_beside_impl_[0-9a-f]{12}', small.get_name())
        assert small.get_name() != second.get_name()
        namespace, services, publishers = options_of(small)
        assert namespace == '/robot'
        assert services == [] and publishers in ([], ['/parameter_events'])
        assert small.context is beside.context
        assert small.get_parameter(USE_SIM_TIME).value is True
        assert small.resolve_topic_name('/clock') == '/time'
        assert small.resolve_topic_name('tf') == '/robot/tf', 'it was resolved before'
        assert [(each.name, each.value) for each in qos_overrides_of(small)] == [(DEPTH, 7)]
        assert [each.topic_name for each in small.subscriptions] == ['/time']
    finally:
        small.destroy_node()
        second.destroy_node()


def published_by(node, small):
    """Return the topics that a small node publishes, by the graph."""
    def topics():
        return [name for name, _ in node.get_publisher_names_and_types_by_node(
            small.get_name(), small.get_namespace())]

    until(lambda: '/parameter_events' in topics())
    return topics()


def test_small_node_ignores_the_command_line_and_writes_no_log(make_node):
    context = Context()
    rclpy.init(context=context, args=['--ros-args', '-r', '__node:=other', '-r', '__ns:=/there'])
    node = make_node('beside', context=context)
    small = internal_node(node, 'impl')
    try:
        assert (node.get_name(), node.get_namespace()) == ('other', '/there')
        assert re.fullmatch(r'_impl_[0-9a-f]{12}', small.get_name())
        assert small.get_namespace() == '/there'
        assert published_by(node, small) == ['/parameter_events']
    finally:
        small.destroy_node()
        node.destroy_node()
        context.try_shutdown()


def test_small_node_without_a_clock_takes_the_time_of_the_system(beside):
    small = internal_node(beside, 'beside_impl', with_clock=False)
    try:
        assert small.get_parameter(USE_SIM_TIME).value is False
        assert small.resolve_topic_name('/clock') == '/clock'
        assert [*small.subscriptions] == []
        assert options_of(small)[1] == []
        assert [(each.name, each.value) for each in qos_overrides_of(small)] == [(DEPTH, 7)]
    finally:
        small.destroy_node()


def test_node_of_its_own_follows_the_command_line_except_for_its_name():
    context = Context()
    rclpy.init(context=context, args=['--ros-args', '-r', '__node:=other', '-r', '__ns:=/there',
                                      '-r', 'tf:=other_tf', '-p', 'use_sim_time:=true'])
    node = node_of_its_own('alone', context)
    try:
        assert re.fullmatch(r'_alone_[0-9a-f]{12}', node.get_name())
        assert options_of(node)[:2] == ('/there', [])
        assert '/rosout' not in options_of(node)[2]
        assert node.resolve_topic_name('tf') == '/there/other_tf'
        assert node.get_parameter(USE_SIM_TIME).value is True
        assert node.context is context
    finally:
        node.destroy_node()
        context.try_shutdown()
    with pytest.raises(RuntimeError, match=r'^Without a node, rclpy.init\(\) has to be called'):
        node_of_its_own('alone', context)
    with pytest.raises(RuntimeError, match=r'^Without a node, rclpy.init\(\) has to be called'):
        node_of_its_own('alone')


def test_context_runs_from_its_beginning_to_its_end():
    context = Context()
    assert is_running(context) is False
    rclpy.init(context=context, args=[])
    assert is_running(context) is True
    context.shutdown()
    assert is_running(context) is False
    context.destroy()
    assert is_running(context) is False


class LockedContext(Context):
    """A context with the lock of Kilted; that of Jazzy has no owner."""

    def __init__(self):
        super().__init__()
        self._lock = threading.RLock()


def test_only_the_thread_that_shuts_a_context_down_has_it_locked(pool):
    context = LockedContext()
    assert is_locked_here(context) is False
    with context._lock:
        assert is_locked_here(context) is True
        assert pool.submit(is_locked_here, context).result() is False
    assert is_locked_here(context) is False
    context._lock = threading.Lock()
    with context._lock:
        assert is_locked_here(context) is False, 'it destroys no nodes then'


def test_node_is_alive_until_it_is_destroyed_or_collected(make_node):
    node = make_node('living')
    reference = weakref.ref(node)
    assert is_alive(reference) is True
    node.destroy_node()
    assert is_alive(reference) is False

    class Gone:
        pass

    gone = Gone()
    reference = weakref.ref(gone)
    del gone
    assert is_alive(reference) is False


class Logger:
    """Takes lines, or fails."""

    def __init__(self, fails):
        self.lines, self.fails = [], fails

    def error(self, text):
        if self.fails:
            raise ValueError('as a logger after the end of ROS')
        self.lines.append(text)


EXIT = (' sys.exit() would end only the thread that receives transforms, and lookups would stop '
        'working, so it is ignored. To end the program, call rclpy.shutdown().')


@pytest.mark.parametrize(('error', 'end'), [
    (SystemExit(3), 'SystemExit: 3\n' + EXIT), (ValueError('bad'), 'ValueError: bad\nthe hint')])
@pytest.mark.parametrize('fails', [False, True])
def test_failure_is_logged_as_an_error_whatever_the_logger_does(log, error, end, fails):
    logger = Logger(fails)
    failures = CallbackFailures(logger)
    try:
        raise error
    except BaseException:
        failures.report('a callback', 'sender', 'the hint')
    [text] = logger.lines or [log().removesuffix('\n')]
    assert text.startswith('a callback failed:\nTraceback (most recent call last):\n')
    assert text.endswith(end)
    assert (log() != '') is fails


def test_failures_reach_the_log_of_ros(log):
    failures = CallbackFailures(rclpy.logging.get_logger('some_node'))
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt:
        failures.report('a callback')
    assert log().startswith('[ERROR]')
