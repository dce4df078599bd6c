# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The subscriptions of a listener to /tf and /tf_static, and its independence of other code."""

import gc
import threading
import weakref

import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.event_handler import UnsupportedEventTypeError
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Task
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    receivers,
    result_of,
    Talker,
    transform,
    until,
    until_waiting,
    WAITED,
)
from tf2_msgs.msg import TFMessage
import tf_tree_py as tf
from tf_tree_py.ros.topics import feed as feed_module

MAP_BASE = TFMessage(transforms=[transform('map', 'base')])
EITHER_THREAD = pytest.mark.parametrize('spin_thread', [True, False])


def call_in_executor(node, function, group=None):
    """Run a function in a timer's callback of a node that is being spun; return its result."""
    def call():
        timer.cancel()
        task()

    task = Task(function)
    timer = node.create_timer(0.0, call, callback_group=group)
    until(task.done)
    return task.result()


def publish_while_a_callback_waits(node, buffer, talker, pool, group=None):
    """Publish map -> base only when a callback of the node waits for it; return its answer."""
    def publish():
        until_waiting(buffer)
        talker.move(transform('map', 'base', 2.0))

    def ask():
        pool.submit(publish)
        return buffer.lookup_transform('map', 'base', at(2.0), PATIENCE)

    return call_in_executor(node, ask, group)


# --- receiving


def test_listener_receives_and_leaves_the_users_node_alone(node, talker, listen, spin):
    def parts():
        return [list(each) for each in (node.subscriptions, node.timers, node.guards,
                                        node.services)]

    before = parts()
    executor = spin(talker.node)
    buffer = listen(node)
    talker.fix(transform('base', 'camera', x=1.0))
    talker.move(transform('map', 'base', 2.0, x=3.0))
    found = buffer.lookup_transform('map', 'camera', LATEST, PATIENCE)
    assert found.transform.translation.x == 4.0
    assert found.header == transform('map', '', 2.0).header
    assert found.child_frame_id == 'camera'
    assert parts() == before
    assert node.executor is None
    assert executor.get_nodes() == [talker.node]
    services = [name for name, _ in node.get_service_names_and_types()]
    assert services
    assert 'transform_listener_impl' not in str(services), 'nobody would answer'


@pytest.mark.parametrize(('spin_thread', 'cls', 'group'), [
    (True, SingleThreadedExecutor, None),
    (False, MultiThreadedExecutor, None),
    (False, MultiThreadedExecutor, ReentrantCallbackGroup()),
])
def test_callback_that_waits_gets_what_arrives(
        node, talker, listen, spin, pool, spin_thread, cls, group):
    buffer = listen(node, spin_thread=spin_thread)
    spin(node, of_type=cls)
    found = publish_while_a_callback_waits(node, buffer, talker, pool, group)
    assert found.header.stamp.sec == 2
    # Each thread of the multi-threaded executor may wait for the others.
    assert list(buffer.feeds.threads) == receivers()


@pytest.mark.parametrize('begin', [
    lambda node: tf.TransformListener(tf.Buffer(), node),
    lambda node: tf.TransformListener(tf.Buffer(), node, static_only=True),
    lambda node: tf.BufferClient(node, 'tf2_buffer_server'),
], ids=['listener', 'static listener', 'client'])
def test_companions_have_hidden_names_of_their_own(node, begin):
    """``ros2 param list`` would wait five seconds for the parameters of each."""
    before = set(node.get_node_names())
    with begin(node), begin(node):
        until(lambda: len(set(node.get_node_names()) - before) == 2)
        for companion in set(node.get_node_names()) - before:
            assert companion.startswith(HIDDEN_NODE_PREFIX)


@EITHER_THREAD
def test_qos_is_that_of_tf2_unless_it_is_chosen(node, listen, spin_thread):
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    listen(node, spin_thread=spin_thread)
    listen(node, qos=best_effort, static_qos=5, spin_thread=spin_thread,
           tf_topic='chosen', tf_static_topic='chosen_static')
    reliable, unreliable = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    volatile, latched = DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL
    for topic, reliability, durability in [
            ('tf', reliable, volatile), ('tf_static', reliable, latched),
            ('chosen', unreliable, volatile), ('chosen_static', reliable, volatile)]:
        (subscription,) = node.get_subscriptions_info_by_topic(f'/{topic}')
        profile = subscription.qos_profile
        assert (profile.reliability, profile.durability) == (reliability, durability)
        assert subscription.topic_type == 'tf2_msgs/msg/TFMessage'


def test_static_only_leaves_tf_alone(node, talker, listen):
    buffer = listen(node, static_only=True)
    assert node.get_subscriptions_info_by_topic('/tf') == []
    talker.fix(transform('base', 'camera'), into=buffer)


# --- names


@pytest.mark.parametrize(('of_node', 'of_listener', 'moving', 'static'), [
    ({}, {'tf_topic': '/robot/tf', 'tf_static_topic': '~/statics'},
     '/robot/tf', '/asking/statics'),
    ({'namespace': '/robot'}, {}, '/tf', '/tf_static'),
    ({'namespace': '/robot'}, {'tf_topic': 'tf', 'tf_static_topic': 'tf_static'},
     '/robot/tf', '/robot/tf_static'),
    ({'cli_args': ['--ros-args', '-r', '/tf:=/robot/tf', '-r', '/tf_static:=fixed_of_robot']},
     {}, '/robot/tf', '/fixed_of_robot'),
], ids=['chosen', 'absolute', 'relative', 'remapped'])
def test_topics_follow_the_options_and_the_node(
        make_node, listen, of_node, of_listener, moving, static):
    buffer = listen(make_node('asking', **of_node), **of_listener)
    other = make_node('other')
    unused = {'/tf', '/tf_static', '/robot/tf', '/robot/tf_static'} - {moving, static}
    assert not any(map(other.get_subscriptions_info_by_topic, unused))
    Talker(other).send(MAP_BASE, moving)
    fixed = tf.StaticTransformBroadcaster(other, tf_static_topic=static)
    fixed.sendTransform(transform('base', 'camera'))
    buffer.lookup_transform('map', 'camera', LATEST, PATIENCE)


def test_remapping_of_the_process_is_followed_and_a_rename_is_not():
    arguments = ['--ros-args', '-r', '/tf:=/robot/tf', '-r', '/clock:=/robot/clock',
                 '-r', '__node:=renamed', '-r', '__ns:=/robot']
    context = Context()
    rclpy.init(context=context, args=arguments)
    node = Node('asking', context=context)
    other = Node('other', context=context, use_global_arguments=False)
    buffer = tf.Buffer()
    with tf.TransformListener(buffer, node):
        names = other.get_node_names_and_namespaces()
        assert [name for name, _ in names].count('renamed') == 1
        assert [space for name, space in names if 'listener_impl' in name] == ['/robot']
        Talker(other).send(MAP_BASE, '/robot/tf')
        buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
        node.set_parameters([rclpy.parameter.Parameter('use_sim_time', value=True)])
        until(lambda: len(other.get_subscriptions_info_by_topic('/robot/clock')) == 2)
    node.destroy_node()
    other.destroy_node()
    context.shutdown()


@EITHER_THREAD
def test_frames_are_renamed_and_left_out_on_the_way_in(node, talker, listen, spin, spin_thread):
    options = {'shared_frames': ['map'], 'spin_thread': spin_thread}
    cases = [
        ({'frame_prefix': 'fleet/'}, 'fleet/robot1/base',
         {'fleet/robot1/camera', 'fleet/robot2/base', 'fleet/lens'}),
        ({'strip_frame_prefix': 'robot1/'}, 'base', {'camera'}),
        ({'frame_filter': {'map', 'robot1/base'}}, 'robot1/base', set()),
        ({'frame_filter': lambda parent, child: child == 'robot2/base'}, 'robot2/base', set())]
    buffers = [listen(node, **chosen, **options) for chosen, *_ in cases]
    spin(node)
    talker.fix(transform('robot1/base', 'robot1/camera', x=1.0))
    # First a message without any edge that the last two keep, then one with some.
    talker.move(transform('robot1/camera', 'lens'), listeners=4)
    talker.move(*(transform('map', f'{robot}/base', x=2.0) for robot in ('robot1', 'robot2')),
                listeners=4)
    for buffer, (_, child, others) in zip(buffers, cases, strict=True):
        found = buffer.lookup_transform('map', child, LATEST, PATIENCE)
        assert found.transform.translation.x == 2.0
        wanted = {'map', child, *others}
        until(lambda buffer=buffer, wanted=wanted: set(buffer.frames()) == wanted)
        assert buffer.statistics().refused == 0


@pytest.mark.parametrize(('options', 'cls', 'words'), [
    ({'frame_filter': 'map'}, ValueError, 'frame_filter has to be a collection'),
    ({'spin_thread': False, 'tf_static_topic': 'no topic'}, RuntimeError, 'to resolve name'),
])
def test_listener_that_cannot_be_leaves_nothing_behind(node, options, cls, words):
    before = list(node.subscriptions)
    with pytest.raises(cls, match=words):
        tf.TransformListener(tf.Buffer(), node, **options)
    assert list(node.subscriptions) == before
    assert receivers() == []


# --- without a node


@pytest.fixture
def process():
    """Initialise ROS for the process, as programs do; return a function that makes a node."""
    nodes = []

    def begin(*arguments):
        rclpy.init(args=['--ros-args', *arguments])
        nodes.append(Node('other', use_global_arguments=False))
        return nodes[0]

    yield begin
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def test_without_a_node_the_command_line_counts_until_ros_ends(process):
    """Although the program keeps no reference to the listener."""
    other = process('-r', '/tf:=/robot/tf', '-r', '__node:=renamed', '-p', 'use_sim_time:=true')
    buffer = tf.Buffer()
    assert tf.TransformListener(buffer).node.get_parameter('use_sim_time').value
    gc.collect()
    Talker(other).send(MAP_BASE, '/robot/tf')
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert 'renamed' not in other.get_node_names()
    (thread,) = receivers()
    rclpy.shutdown()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_without_a_node_ros_must_run_and_there_is_none_for_you_to_spin(process):
    with pytest.raises(RuntimeError, match=r'rclpy\.init\(\) has to be called first'):
        tf.TransformListener(tf.Buffer())
    process()
    with pytest.raises(ValueError, match='spin_thread=False needs a node of yours'):
        tf.TransformListener(tf.Buffer(), spin_thread=False)
    tf.TransformListener(tf.Buffer()).close()
    assert receivers() == []


# --- life cycle


@EITHER_THREAD
def test_closed_listener_hears_no_more_and_the_buffer_keeps_what_it_has(
        node, make_node, talker, listen, spin, spin_thread):
    buffer = tf.Buffer()
    with tf.TransformListener(buffer, node, spin_thread=spin_thread) as listener:
        assert len(receivers()) == (1 if spin_thread else 0)
        spin(node)
        talker.move(transform('map', 'base', 1.0), into=buffer)
        listener.unregister()
        listener.close()
    listener.close()
    assert receivers() == []
    until(lambda: node.get_subscriptions_info_by_topic('/tf') == [])
    other = listen(make_node('other'))
    talker.move(transform('map', 'base', 2.0), into=other)
    assert buffer.lookup_transform('map', 'base', LATEST).header.stamp.sec == 1


def test_listener_whose_node_is_destroyed_hears_no_more_and_ends(
        node, make_node, talker, listen, pool):
    buffer, other = listen(node), listen(make_node('other'))
    talker.move(transform('map', 'base', 1.0), listeners=2, into=buffer)
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(2.0), PATIENCE)
    until_waiting(buffer)
    node.destroy_node()
    talker.move(transform('map', 'base', 2.0), into=other)
    with pytest.raises(tf.ExtrapolationException, match='the listener was closed'):
        asked.result(PATIENCE_S)
    until(lambda: len(receivers()) == 1)
    assert buffer.statistics().accepted == 1


def test_middleware_that_does_not_report_who_leaves_has_listeners_too(
        node, listen, talker, monkeypatch):
    mismatches = feed_module.mismatches

    def without_matched(topic, log, on_left=None):
        if on_left is not None:
            raise UnsupportedEventTypeError('matched')
        return mismatches(topic, log)

    monkeypatch.setattr(feed_module, 'mismatches', without_matched)
    buffer = listen(node)
    talker.move(transform('map', 'base', 1.0), into=buffer)
    assert buffer.can_transform('map', 'base', at(1.0))


def test_threads_may_make_and_close_listeners_at_once(node, pool):
    """Each closes those of the others, too."""
    def turn(listeners, start):
        listeners.append(tf.TransformListener(tf.Buffer(), node))
        start.wait()
        for listener in listeners:
            listener.close()

    for _ in range(20):
        list(pool.map(turn, [[]] * 4, [threading.Barrier(4)] * 4, timeout=PATIENCE_S))
    assert receivers() == []
    until(lambda: node.get_subscriptions_info_by_topic('/tf') == [])


def test_listener_that_nobody_keeps_lives_as_long_as_its_node(context, talker):
    node, buffer = Node('forgotten', context=context), tf.Buffer()
    tf.TransformListener(buffer, node)
    gc.collect()
    (thread,) = receivers()
    talker.move(transform('map', 'base'), into=buffer)
    del node
    gc.collect()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


@EITHER_THREAD
def test_node_may_be_destroyed_before_the_listener_is_closed(context, spin_thread):
    node = Node('gone', context=context)
    tf.TransformListener(tf.Buffer(), node).close()
    listener = tf.TransformListener(tf.Buffer(), node, spin_thread=spin_thread)
    node.destroy_node()
    listener.close()
    assert receivers() == []


def test_listener_after_listener_may_fill_a_buffer_and_let_go_of_it(node, talker):
    buffer = tf.Buffer()
    gone = weakref.ref(buffer)
    for stamp in (1.0, 2.0, 3.0):
        with tf.TransformListener(buffer, node):
            talker.move(transform('map', 'base', stamp), into=buffer)
    assert buffer.edges()[0].samples == 3
    del buffer
    gc.collect()
    assert gone() is None


# --- served by the user's executor


def test_waiting_in_the_thread_that_feeds_fails_at_once_and_says_why(
        node, make_node, talker, listen, spin, pool):
    def in_callback(ask, *question, **options):
        return call_in_executor(node, lambda: ask(*question, PATIENCE, **options))

    buffer = tf.Buffer()
    listener = tf.TransformListener(buffer, node, spin_thread=False)
    spin(node)
    talker.move(transform('map', 'base', 1.0), into=buffer)
    for question, cls in ((('map', 'base', at(2.0)), tf.ExtrapolationException),
                          (('map', 'x', LATEST), tf.LookupException)):
        with pytest.raises(cls, match='Did not wait: this thread delivers') as raised:
            in_callback(buffer.lookup_transform, *question)
        assert raised.value.waited_s is None
    assert in_callback(buffer.can_transform, 'map', 'base', at(1.0))
    # For a name with a slash, waiting could never have helped.
    for frame, did_not_wait in (('base', True), ('/base', False)):
        found, why = in_callback(
            buffer.can_transform, 'map', frame, at(2.0), return_debug_tuple=True)
        assert not found
        assert ('Did not wait' in why) == did_not_wait
    # Once its listener is closed, the thread may wait again.
    listener.close()
    listen(make_node('other'), buffer)
    found = publish_while_a_callback_waits(node, buffer, talker, pool)
    assert found.header.stamp.sec == 2


def test_thread_that_spun_once_may_wait_when_another_spins(node, talker, listen, spin, context):
    buffer = listen(node, spin_thread=False)
    talker.fix(transform('base', 'camera'))
    begin = SingleThreadedExecutor(context=context)
    begin.add_node(node)
    while not buffer.statistics().accepted:
        begin.spin_once(PATIENCE_S)
    begin.shutdown()
    assert threading.current_thread() in buffer.feeds.threads
    spin(node)
    talker.move(transform('map', 'base', 1.0))
    until(lambda: buffer.statistics().accepted == 2)
    with pytest.raises(tf.ExtrapolationException, match=WAITED):
        buffer.lookup_transform('map', 'camera', at(2.0), lasting(0.02))


NOT_SPUN = 'The node /asking is not being spun, so its TransformListener receives nothing'
NOT_RUN = 'The executor of the node /asking has run none of its callbacks for 1.'
NOTHING_YET = 'Nothing has been received yet: does any node publish'


def failure(buffer, seconds):
    with pytest.raises(tf.LookupException) as raised:
        buffer.lookup_transform('map', 'base', LATEST, lasting(seconds))
    return raised.value.hint


def test_wait_on_a_node_that_nobody_spins_says_so(node, listen, talker):
    buffer = listen(node, spin_thread=False)
    talker.move(transform('map', 'base', 1.0))
    assert failure(buffer, 0.11).startswith(NOT_SPUN)
    assert failure(buffer, 0.01).startswith(NOT_SPUN), 'it was not spun before, either'
    future = buffer.wait_for_transform_async('map', 'base', LATEST, lasting(0.01))
    with pytest.raises(tf.LookupException, match=NOT_SPUN):
        result_of(future)
    # A wait that is too short to be sure.
    assert failure(listen(node, spin_thread=False), 0.001).startswith(NOTHING_YET)


def test_wait_on_a_node_whose_executor_does_not_spin_says_so(node, listen, executor):
    buffer = listen(node, spin_thread=False)
    executor.add_node(node)
    assert failure(buffer, 0.2).startswith(NOTHING_YET), 'its thread may be late'
    assert failure(buffer, 1.0).startswith(NOT_RUN)


def test_wait_on_a_node_that_was_destroyed_ends_with_its_error(node, listen):
    buffer = listen(node, spin_thread=False)
    future = buffer.wait_for_transform_async('map', 'base', LATEST, lasting(0.2))
    node.destroy_node()
    with pytest.raises(tf.LookupException, match=NOT_SPUN):
        result_of(future)


EXECUTORS = pytest.mark.parametrize('name', [
    'executors.SingleThreadedExecutor', 'executors.MultiThreadedExecutor',
    'experimental.EventsExecutor'])


@EXECUTORS
def test_wait_on_a_node_that_is_spun_does_not_say_that(node, listen, context, pool, name):
    module, executor_name = name.split('.')
    executor = getattr(pytest.importorskip(f'rclpy.{module}'), executor_name)(context=context)
    buffer = listen(node, spin_thread=False)
    executor.add_node(node)
    waiting = pool.submit(failure, buffer, 1.1)
    while not waiting.done():
        executor.spin_once(timeout_sec=0.02)
    assert waiting.result().startswith(NOTHING_YET)
    executor.remove_node(node)
    # Between two calls of spin_once the node is in no executor.
    waiting = pool.submit(failure, buffer, 0.3)
    while not waiting.done():
        executor.add_node(node)
        executor.spin_once(timeout_sec=0.01)
        executor.remove_node(node)
    assert waiting.result().startswith(NOTHING_YET)
    executor.shutdown()


def test_listener_with_a_thread_beside_one_that_is_not_spun_is_enough(node, make_node, listen):
    buffer = listen(node, spin_thread=False)
    listen(make_node('other'), buffer)
    assert failure(buffer, 0.11).startswith(NOTHING_YET)
