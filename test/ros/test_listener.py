# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The subscriptions of a listener to /tf and /tf_static, and its independence of other code."""

import gc
import re
import threading
import weakref

import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    Talker,
    transform,
    until,
    until_waiting,
    WAITED,
)
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage
from tf_tree_py import (
    Buffer,
    BufferClient,
    ExtrapolationException,
    LookupException,
    TransformListener,
)

NEVER_ENOUGH = lasting(0.02)


def receivers():
    return [thread for thread in threading.enumerate() if thread.name.endswith(' receiver')]


def publish_when_awaited(pool, buffer, talker, *transforms):
    """Publish from another thread, but only when a thread waits for it."""
    def publish():
        until_waiting(buffer)
        talker.move(*transforms)

    pool.submit(publish)


def call_in_executor(node, function, **options):
    """Run a function in a timer's callback of a node that is being spun; return its result."""
    done = rclpy.task.Future()

    def callback():
        timer.cancel()
        if not done.done():
            try:
                done.set_result(function())
            except Exception as error:
                done.set_exception(error)

    finished = threading.Event()
    done.add_done_callback(lambda _: finished.set())
    timer = node.create_timer(0.0, callback, **options)
    assert finished.wait(PATIENCE_S)
    return done.result()


# --- receiving


def test_node_need_not_be_spun(node, talker, listen):
    buffer = listen(node)
    talker.fix(transform('base', 'camera', x=1.0))
    talker.move(transform('map', 'base', 2.0, x=3.0))
    found = buffer.lookup_transform('map', 'camera', LATEST, PATIENCE)
    assert found.transform.translation.x == 4.0
    assert found.header == transform('map', '', 2.0).header
    assert found.child_frame_id == 'camera'


def test_lookup_in_a_callback_of_a_single_threaded_executor_gets_what_arrives(
        node, talker, listen, spin, pool):
    buffer = listen(node)
    spin(node, talker.node)

    def ask():
        publish_when_awaited(pool, buffer, talker, transform('map', 'base', 2.0))
        return buffer.lookup_transform('map', 'base', at(2.0), PATIENCE)

    assert call_in_executor(node, ask).header.stamp.sec == 2


def test_users_node_and_executor_are_left_alone(node, talker, listen, spin):
    before = [list(kind) for kind in (node.subscriptions, node.timers, node.guards, node.services)]
    executor = spin(talker.node)
    buffer = listen(node)
    talker.move(transform('map', 'base'))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert [list(kind) for kind in (node.subscriptions, node.timers, node.guards,
                                    node.services)] == before
    assert node.executor is None
    assert executor.get_nodes() == [talker.node]


def test_companion_offers_no_service_that_it_would_not_answer(node, listen):
    listen(node)
    names = [name for name, _ in node.get_service_names_and_types()]
    assert names
    assert not [name for name in names if 'transform_listener_impl' in name]


@pytest.mark.parametrize('begin', [
    lambda node: TransformListener(Buffer(), node),
    lambda node: TransformListener(Buffer(), node, static_only=True),
    lambda node: BufferClient(node, 'tf2_buffer_server'),
], ids=['listener', 'static listener', 'client'])
def test_companion_is_not_listed_by_ros2(node, begin):
    """``ros2 param list`` would wait five seconds for the parameters of each."""
    before = set(node.get_node_names())
    with begin(node):
        until(lambda: set(node.get_node_names()) > before)
        (companion,) = set(node.get_node_names()) - before
        assert companion.startswith(HIDDEN_NODE_PREFIX)


def test_both_topics_are_subscribed_as_in_tf2(node, listen):
    listen(node)
    (dynamic,) = node.get_subscriptions_info_by_topic('/tf')
    (static,) = node.get_subscriptions_info_by_topic('/tf_static')
    assert dynamic.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    assert dynamic.qos_profile.durability is DurabilityPolicy.VOLATILE
    assert static.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    assert static.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert dynamic.topic_type == static.topic_type == 'tf2_msgs/msg/TFMessage'


@pytest.mark.parametrize('spin_thread', [True, False])
def test_qos_may_be_chosen(node, listen, spin_thread):
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    listen(node, qos=best_effort, static_qos=5, spin_thread=spin_thread)
    (dynamic,) = node.get_subscriptions_info_by_topic('/tf')
    (static,) = node.get_subscriptions_info_by_topic('/tf_static')
    assert dynamic.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert static.qos_profile.durability is DurabilityPolicy.VOLATILE


def test_publisher_that_cannot_be_heard_is_reported(node, make_node, listen, log):
    listen(node)
    make_node('careless').create_publisher(TFMessage, '/tf_static', 1)
    until(lambda: "topic '/tf_static', offering incompatible QoS" in log()
          and 'DURABILITY' in log())


def test_static_only_leaves_tf_alone(node, talker, listen):
    buffer = listen(node, static_only=True)
    assert node.get_subscriptions_info_by_topic('/tf') == []
    talker.move(transform('map', 'base'), listeners=0)
    talker.fix(transform('base', 'camera'))
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    assert buffer.frames() == ['camera', 'base']


def test_topics_may_be_chosen(node, make_node, listen):
    buffer = listen(node, tf_topic='/robot/tf', tf_static_topic='~/statics')
    assert node.get_subscriptions_info_by_topic('/tf') == []
    talker = Talker(make_node('talking'))
    talker.send(TFMessage(transforms=[transform('map', 'base')]), '/robot/tf')
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert len(node.get_subscriptions_info_by_topic('/asking/statics')) == 1


# --- names


def test_absolute_topics_stay_outside_a_namespace(make_node, listen, talker):
    buffer = listen(make_node('asking', namespace='/robot'))
    talker.move(transform('map', 'base'))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)


def test_relative_topics_follow_the_namespace(make_node, listen):
    node = make_node('asking', namespace='/robot')
    buffer = listen(node, tf_topic='tf', tf_static_topic='tf_static')
    assert len(node.get_subscriptions_info_by_topic('/robot/tf_static')) == 1
    Talker(make_node('talking')).send(TFMessage(transforms=[transform('map', 'base')]),
                                      '/robot/tf')
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)


def test_remapping_of_the_node_is_followed(make_node, listen):
    other = make_node('other')
    node = make_node('asking', cli_args=['--ros-args', '-r', '/tf:=/robot/tf',
                                         '-r', '/tf_static:=static_of_robot'])
    listen(node)
    assert len(other.get_subscriptions_info_by_topic('/robot/tf')) == 1
    assert len(other.get_subscriptions_info_by_topic('/static_of_robot')) == 1
    assert other.get_subscriptions_info_by_topic('/tf') == []


def test_remapping_of_the_process_is_followed_and_a_rename_is_not():
    arguments = ['--ros-args', '-r', '/tf:=/robot/tf', '-r', '/clock:=/robot/clock',
                 '-r', '__node:=renamed', '-r', '__ns:=/robot']
    context = Context()
    rclpy.init(context=context, args=arguments)
    node = Node('asking', context=context)
    other = Node('other', context=context, use_global_arguments=False)
    buffer = Buffer()
    with TransformListener(buffer, node):
        names = [name for name, _ in other.get_node_names_and_namespaces()]
        assert names.count('renamed') == 1
        (companion,) = [(name, namespace) for name, namespace
                        in other.get_node_names_and_namespaces() if 'listener_impl' in name]
        assert companion[1] == '/robot'
        talker = Talker(other)
        talker.send(TFMessage(transforms=[transform('map', 'base')]), '/robot/tf')
        buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
        node.set_parameters([rclpy.parameter.Parameter('use_sim_time', value=True)])
        until(lambda: len(other.get_subscriptions_info_by_topic('/robot/clock')) == 2)
    node.destroy_node()
    other.destroy_node()
    context.shutdown()


def test_two_nodes_of_one_name_do_not_share_a_companion(make_node, listen):
    first, second = make_node('twin'), make_node('twin')
    listen(first)
    listen(second)
    companions = [name for name in first.get_node_names() if 'listener_impl' in name]
    assert len(set(companions)) == 2


@pytest.mark.parametrize('spin_thread', [True, False])
def test_prefix_is_added_on_the_way_in(node, talker, listen, spin, spin_thread):
    buffer = listen(node, frame_prefix='robot1/', shared_frames=['map'], spin_thread=spin_thread)
    spin(node)
    talker.fix(transform('base', 'camera', x=1.0))
    talker.move(transform('map', 'base', x=2.0))
    found = buffer.lookup_transform('map', 'robot1/camera', LATEST, PATIENCE)
    assert found.transform.translation.x == 3.0
    assert sorted(buffer.frames()) == ['map', 'robot1/base', 'robot1/camera']


def test_prefix_is_taken_away_on_the_way_in_and_other_robots_are_left_out(node, talker, listen):
    buffer = listen(node, strip_frame_prefix='robot1/', shared_frames=['map'])
    talker.move(*(transform(parent, f'{robot}/{child}') for robot in ('robot1', 'robot2')
                  for parent, child in (('map', 'odom'), (f'{robot}/odom', 'base'))))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert sorted(buffer.frames()) == ['base', 'map', 'odom']


def test_filter_keeps_out_what_nobody_looks_up(node, talker, listen):
    legs = [transform('base', f'leg{number}') for number in range(9)]
    both = listen(node, frame_filter={'map', 'odom', 'base'})
    one = listen(node, frame_filter=lambda parent, child: child == 'odom')
    # First a message without any accepted edge, then one with some.
    talker.move(*legs, listeners=2)
    talker.move(*legs, transform('odom', 'base'), transform('map', 'odom'), listeners=2)
    both.lookup_transform('map', 'base', LATEST, PATIENCE)
    one.lookup_transform('map', 'odom', LATEST, PATIENCE)
    assert [edge.child for edge in both.edges()] == ['base', 'odom']
    assert [edge.child for edge in one.edges()] == ['odom']
    assert both.statistics().refused == one.statistics().refused == 0


def test_one_name_where_several_frames_belong_is_refused_and_nothing_is_left_behind(node):
    with pytest.raises(ValueError, match='frame_filter has to be a collection'):
        TransformListener(Buffer(), node, frame_filter='map')
    assert receivers() == []


# --- without a node


@pytest.fixture
def process():
    """Initialise ROS for the process, as programs do."""
    def begin(*arguments):
        rclpy.init(args=['--ros-args', *arguments])
        return rclpy.get_default_context()

    yield begin
    rclpy.try_shutdown()


def test_without_a_node_the_command_line_counts(process):
    context = process('-r', '/tf:=/robot/tf', '-r', '__node:=renamed', '-p', 'use_sim_time:=true')
    other = Node('other', context=context, use_global_arguments=False)
    buffer = Buffer()
    with TransformListener(buffer) as listener:
        Talker(other).send(TFMessage(transforms=[transform('map', 'base')]), '/robot/tf')
        buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
        assert listener.node.get_parameter('use_sim_time').value
        assert 'renamed' not in other.get_node_names()
    assert receivers() == []
    other.destroy_node()


def test_without_a_node_a_listener_that_nobody_keeps_lives_until_ros_ends(process):
    context = process()
    buffer = Buffer()
    TransformListener(buffer)
    gc.collect()
    other = Node('other', context=context)
    Talker(other).move(transform('map', 'base'))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    other.destroy_node()
    (thread,) = receivers()
    rclpy.shutdown()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_without_a_node_ros_has_to_be_initialised():
    with pytest.raises(RuntimeError, match=r'rclpy\.init\(\) has to be called first'):
        TransformListener(Buffer())


def test_without_a_node_there_is_none_for_you_to_spin(process):
    process()
    with pytest.raises(ValueError, match='spin_thread=False needs a node of yours'):
        TransformListener(Buffer(), spin_thread=False)


# --- several listeners


def test_two_listeners_may_fill_one_buffer(make_node, talker):
    buffer = Buffer()
    first = TransformListener(buffer, make_node('first'))
    second = TransformListener(buffer, make_node('second'), tf_topic='/other/tf')
    talker.move(transform('map', 'odom'))
    buffer.lookup_transform('map', 'odom', LATEST, PATIENCE)
    other = Talker(make_node('other'))
    other.send(TFMessage(transforms=[transform('odom', 'base')]), '/other/tf')
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    first.close()
    other.send(TFMessage(transforms=[transform('odom', 'base', 2.0)]), '/other/tf')
    buffer.lookup_transform('odom', 'base', at(2.0), PATIENCE)
    second.close()


def test_one_node_may_have_several_listeners(node, talker, listen):
    first, second = listen(node), listen(node)
    talker.move(transform('map', 'odom'), listeners=2)
    for buffer in (first, second):
        buffer.lookup_transform('map', 'odom', LATEST, PATIENCE)


# --- life cycle


@pytest.mark.parametrize('spin_thread', [True, False])
def test_closed_listener_hears_no_more_and_the_buffer_keeps_what_it_has(
        node, make_node, talker, listen, spin, spin_thread):
    buffer = Buffer()
    listener = TransformListener(buffer, node, spin_thread=spin_thread)
    spin(node)
    talker.move(transform('map', 'base', 1.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    listener.close()
    other = listen(make_node('other'))
    talker.move(transform('map', 'base', 2.0))
    other.lookup_transform('map', 'base', at(2.0), PATIENCE)
    assert buffer.lookup_transform('map', 'base', LATEST).header.stamp.sec == 1
    assert len(node.get_subscriptions_info_by_topic('/tf')) == 1


@pytest.mark.parametrize('spin_thread', [True, False])
def test_listener_may_be_closed_twice_and_by_each_of_its_names(node, spin_thread):
    with TransformListener(Buffer(), node, spin_thread=spin_thread) as listener:
        assert isinstance(listener, TransformListener)
        listener.unregister()
        listener.close()
    listener.close()
    assert receivers() == []
    assert node.get_subscriptions_info_by_topic('/tf') == []


def test_threads_may_close_one_listener_at_once(node, pool):
    for _ in range(20):
        listener = TransformListener(Buffer(), node)
        start = threading.Barrier(4)
        closings = [pool.submit(lambda listener=listener, start=start: (start.wait(),
                                                                        listener.close()))
                    for _ in range(4)]
        for closing in closings:
            closing.result(PATIENCE_S)
    assert receivers() == []


def test_listener_that_nobody_keeps_lives_on_with_its_node(node, talker):
    buffer = Buffer()
    listener = weakref.ref(TransformListener(buffer, node))
    gc.collect()
    talker.move(transform('map', 'base'))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    listener().close()


def test_listener_ends_with_the_last_reference_to_its_node(context):
    node = Node('forgotten', context=context)
    TransformListener(Buffer(), node)
    (thread,) = receivers()
    del node
    gc.collect()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_node_may_be_destroyed_before_the_listener_is_closed(context):
    node = Node('gone', context=context)
    for spin_thread in (True, False):
        listener = TransformListener(Buffer(), node, spin_thread=spin_thread)
        if not spin_thread:
            node.destroy_node()
        listener.close()
    node = Node('gone_too', context=context)
    listener = TransformListener(Buffer(), node)
    node.destroy_node()
    listener.close()
    assert receivers() == []


def test_buffer_is_let_go_when_its_listener_is_closed(node):
    buffer = Buffer()
    gone = weakref.ref(buffer)
    TransformListener(buffer, node).close()
    del buffer
    gc.collect()
    assert gone() is None


def test_listener_after_listener_may_fill_one_buffer(node, talker):
    buffer = Buffer()
    for stamp in (1.0, 2.0, 3.0):
        with TransformListener(buffer, node):
            talker.move(transform('map', 'base', stamp))
            buffer.lookup_transform('map', 'base', at(stamp), PATIENCE)
    assert buffer.edges()[0].samples == 3


# --- served by the user's executor


@pytest.mark.parametrize('kind', [rclpy.executors.SingleThreadedExecutor, MultiThreadedExecutor])
def test_without_a_thread_the_users_executor_feeds_the_buffer(node, talker, listen, spin, kind):
    buffer = listen(node, spin_thread=False)
    assert receivers() == []
    spin(node, kind=kind)
    talker.fix(transform('base', 'camera'))
    talker.move(transform('map', 'base'))
    buffer.lookup_transform('map', 'camera', LATEST, PATIENCE)


def test_waiting_in_the_thread_that_feeds_fails_at_once_and_says_why(node, talker, listen, spin):
    buffer = listen(node, spin_thread=False)
    spin(node)
    talker.move(transform('map', 'base', 1.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    for frame, stamp, kind in (('base', 2.0, ExtrapolationException), ('x', 0.0, LookupException)):
        with pytest.raises(kind, match='Did not wait: this thread delivers') as raised:
            call_in_executor(node, lambda frame=frame, stamp=stamp: buffer.lookup_transform(
                'map', frame, at(stamp), PATIENCE))
        assert raised.value.waited_s is None
    found, why = call_in_executor(node, lambda: buffer.can_transform(
        'map', 'base', at(2.0), PATIENCE, return_debug_tuple=True))
    assert not found
    assert 'Did not wait' in why
    assert call_in_executor(node, lambda: buffer.can_transform('map', 'base', at(1.0), PATIENCE))
    found, why = call_in_executor(node, lambda: buffer.can_transform(
        'map', '/base', at(2.0), PATIENCE, return_debug_tuple=True))
    assert not found
    assert 'Did not wait' not in why, 'waiting could never have helped'


def test_once_its_listener_is_closed_a_thread_may_wait_again(
        node, make_node, talker, listen, spin, pool):
    buffer = Buffer()
    listener = TransformListener(buffer, node, spin_thread=False)
    spin(node)
    talker.move(transform('map', 'base', 1.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    listener.close()
    listen(make_node('other'), buffer)

    def ask():
        publish_when_awaited(pool, buffer, talker, transform('map', 'base', 2.0))
        return buffer.lookup_transform('map', 'base', at(2.0), PATIENCE)

    assert call_in_executor(node, ask).header.stamp.sec == 2


def test_other_threads_than_the_feeding_one_wait(node, talker, listen, spin):
    buffer = listen(node, spin_thread=False)
    spin(node)
    talker.move(transform('map', 'base', 1.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    with pytest.raises(ExtrapolationException, match=WAITED):
        buffer.lookup_transform('map', 'base', at(2.0), NEVER_ENOUGH)


def test_new_thread_with_a_recycled_identifier_may_wait(node, listen):
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    (thread,) = receivers()
    listener.close()
    listen(node, buffer)
    answers = []
    for _ in range(20):
        asking = threading.Thread(target=lambda: answers.append(
            buffer.can_transform('a', 'b', LATEST, lasting(0.001), return_debug_tuple=True)))
        asking.start()
        asking.join()
        if asking.ident == thread.ident:
            break
    for _, why in answers:
        assert re.search(WAITED, why)


@pytest.mark.parametrize('group', [None, ReentrantCallbackGroup()])
def test_callback_that_waits_in_a_multi_threaded_executor_gets_what_arrives(
        node, talker, listen, spin, pool, group):
    buffer = listen(node, spin_thread=False)
    spin(node, kind=MultiThreadedExecutor)

    def ask():
        publish_when_awaited(pool, buffer, talker, transform('map', 'base', 2.0))
        return buffer.lookup_transform('map', 'base', at(2.0), PATIENCE)

    found = call_in_executor(node, ask, callback_group=group)
    assert found.header.stamp.sec == 2
    assert not buffer.feeds.threads, 'each of the threads may wait for the others'


def test_topic_that_cannot_be_leaves_no_subscription_behind(node):
    before = list(node.subscriptions)
    with pytest.raises(RuntimeError, match='failed to resolve name'):
        TransformListener(Buffer(), node, spin_thread=False, tf_static_topic='no topic')
    assert list(node.subscriptions) == before


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
    with pytest.raises(ExtrapolationException, match=WAITED):
        buffer.lookup_transform('map', 'camera', at(2.0), NEVER_ENOUGH)


def test_users_callbacks_run_while_the_listener_works(node, talker, listen, spin):
    arrived = threading.Event()
    node.create_subscription(Empty, 'ping', lambda _: arrived.set(), 1)
    listen(node)
    spin(node)
    publisher = talker.node.create_publisher(Empty, 'ping', 1)
    talker.until_heard(publisher)
    publisher.publish(Empty())
    assert arrived.wait(PATIENCE_S)


# --- the names of publishers


def authority_of(buffer, child):
    (name,) = [edge.authority for edge in buffer.edges() if edge.child == child]
    return name


def test_authority_is_the_publishing_node(make_node, listen, node):
    buffer = listen(node)
    Talker(make_node('localiser', namespace='/robot')).move(transform('map', 'odom'))
    Talker(make_node('calibration')).fix(transform('base', 'camera'))
    for frames in (('map', 'odom'), ('base', 'camera')):
        buffer.lookup_transform(*frames, LATEST, PATIENCE)
    until(lambda: authority_of(buffer, 'odom') == '/robot/localiser')
    until(lambda: authority_of(buffer, 'camera') == '/calibration')


def test_of_several_publishers_all_are_named(make_node, listen, node):
    first, second = Talker(make_node('b')), Talker(make_node('a'))
    for talker in (first, second):
        talker.fix(transform('base', 'camera'))
    buffer = listen(node)
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    until(lambda: authority_of(buffer, 'camera') == 'one of /a, /b')


def test_second_publisher_is_among_those_named_in_its_first_refusal(
        make_node, listen, node, log):
    """Although the name of the first is cached for a second."""
    buffer = listen(node)
    Talker(make_node('first')).move(transform('map', 'odom'))
    until(lambda: buffer.edges() and authority_of(buffer, 'odom') == '/first')
    second = make_node('second')
    publisher = second.create_publisher(TFMessage, '/tf', 10)
    until(lambda: 'second' in [info.node_name for info in node.get_publishers_info_by_topic('/tf')]
          and publisher.get_subscription_count() == 1)
    publisher.publish(TFMessage(transforms=[transform('odom', 'map')]))
    until(lambda: 'would close a loop' in log())
    assert "Refused transform 'odom' -> 'map' from 'one of /first, /second'" in log()
    assert "kept: 'map' -> 'odom' from '/first'" in log()


def test_several_publishers_of_one_node_are_that_node(make_node, listen, node):
    talking = make_node('talking')
    Talker(talking).fix(transform('base', 'camera'))
    Talker(talking).fix(transform('base', 'imu'))
    buffer = listen(node)
    buffer.lookup_transform('camera', 'imu', LATEST, PATIENCE)
    until(lambda: authority_of(buffer, 'imu') == '/talking')


def test_authority_is_known_though_the_transform_came_before_the_name(context, node, listen):
    """DDS announces a participant's nodes after its publishers have been matched."""
    listening = listen(node)
    other = Context()
    rclpy.init(context=other, args=[])
    publisher = Node('calibration', context=other)
    Talker(publisher).fix(transform('base', 'camera'))
    listening.lookup_transform('base', 'camera', LATEST, PATIENCE)
    assert '_UNKNOWN_' not in listening.all_frames_as_yaml()
    until(lambda: authority_of(listening, 'camera') == '/calibration')
    publisher.destroy_node()
    other.shutdown()


def test_name_that_was_missing_is_asked_for_when_it_is_wanted(node, talker, listen):
    buffer = listen(node)
    assert buffer.set_transform(transform('map', 'odom'), 'unknown publisher of /tf')
    assert buffer.set_transform_static(transform('base', 'imu'), 'unknown publisher of /tf_static')
    assert authority_of(buffer, 'imu') == 'unknown publisher of /tf_static'
    talker.fix(transform('base', 'camera'))
    until(lambda: authority_of(buffer, 'imu') == '/talking')
    assert authority_of(buffer, 'odom') == 'unknown publisher of /tf'


def test_closed_listeners_buffer_still_tells_who_sent_what(node, talker):
    buffer = Buffer()
    with TransformListener(buffer, node):
        talker.fix(transform('base', 'camera'))
        buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
        until(lambda: authority_of(buffer, 'camera') == '/talking')
    assert authority_of(buffer, 'camera') == '/talking'


@pytest.mark.parametrize('spin_thread', [True, False])
def test_listing_still_works_when_ros_has_shut_down(context, node, spin_thread):
    buffer = Buffer()
    TransformListener(buffer, node, spin_thread=spin_thread)
    buffer.set_transform(transform('map', 'base'), 'unknown publisher of /tf')
    context.shutdown()
    assert authority_of(buffer, 'base') == 'unknown publisher of /tf'
