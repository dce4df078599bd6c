# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages that the broadcasters send."""

import copy
import threading

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_helpers import LATEST, PATIENCE, PATIENCE_S, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.ros.topics.qos import static_listener_qos


@pytest.fixture
def heard(make_node, spin):
    """Subscribe to a topic; return a function that waits for a number of its messages."""
    def begin(topic, qos=100):
        messages, arrived = [], threading.Semaphore(0)

        def take(message):
            messages.append(message)
            arrived.release()

        node = make_node('hearing')
        subscription = node.create_subscription(TFMessage, topic, take, qos)
        spin(node)
        until(lambda: subscription.get_publisher_count())

        def wait(count):
            for _ in range(count):
                assert arrived.acquire(timeout=PATIENCE_S)
            return messages

        return wait

    return begin


def profile_on_the_graph(node, topic):
    (info,) = node.get_publishers_info_by_topic(topic)
    return info.qos_profile


def test_moving_transforms_go_out_reliable_and_volatile(node):
    broadcaster = TransformBroadcaster(node)
    on_graph = profile_on_the_graph(node, '/tf')
    assert on_graph.reliability is ReliabilityPolicy.RELIABLE
    assert on_graph.durability is DurabilityPolicy.VOLATILE
    assert broadcaster.pub_tf.qos_profile.depth == 100


def test_static_transforms_go_out_reliable_and_latched(node):
    broadcaster = StaticTransformBroadcaster(node)
    on_graph = profile_on_the_graph(node, '/tf_static')
    assert on_graph.reliability is ReliabilityPolicy.RELIABLE
    assert on_graph.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert broadcaster.pub_tf.qos_profile.depth == 1


@pytest.mark.parametrize(('kind', 'topic'), [
    (TransformBroadcaster, '/tf'), (StaticTransformBroadcaster, '/tf_static')])
def test_qos_may_be_chosen(node, kind, topic):
    broadcaster = kind(node, QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT))
    assert profile_on_the_graph(node, topic).reliability is ReliabilityPolicy.BEST_EFFORT
    assert broadcaster.pub_tf.qos_profile.depth == 7
    assert kind(node, qos=3).pub_tf.qos_profile.depth == 3


@pytest.mark.parametrize(('kind', 'option'), [
    (TransformBroadcaster, 'tf_topic'), (StaticTransformBroadcaster, 'tf_static_topic')])
def test_topic_may_be_chosen_and_lies_in_the_namespace(make_node, kind, option):
    broadcaster = kind(make_node('talking', namespace='/robot1'), **{option: 'transforms'})
    assert broadcaster.pub_tf.topic_name == '/robot1/transforms'


@pytest.mark.parametrize(('kind', 'topic'), [
    (TransformBroadcaster, '/tf'), (StaticTransformBroadcaster, '/tf_static')])
def test_prefix_is_added_on_the_way_out_to_a_copy(node, heard, kind, topic):
    broadcaster = kind(node, frame_prefix='robot1/', shared_frames=['map'])
    wait = heard(topic)
    message = transform('map', 'odom', 3.0, x=1.0)
    before = copy.deepcopy(message)
    broadcaster.sendTransform([message, transform('odom', '/base')])
    first, second = wait(1)[0].transforms
    assert first == transform('map', 'robot1/odom', 3.0, x=1.0)
    assert second == transform('robot1/odom', 'robot1/base')
    assert message == before


@pytest.mark.parametrize('form', [
    lambda a, b: [a, b], lambda a, b: (a, b), lambda a, b: (m for m in (a, b))],
    ids=['list', 'tuple', 'generator'])
def test_several_transforms_are_one_message(node, heard, form):
    broadcaster = TransformBroadcaster(node)
    wait = heard('/tf')
    a, b = transform('map', 'odom', x=1.0), transform('odom', 'base', x=2.0)
    broadcaster.sendTransform(form(a, b))
    broadcaster.sendTransform(a)
    broadcaster.sendTransform([])
    first, second, third = wait(3)
    assert first.transforms == [a, b]
    assert second.transforms == [a]
    assert third.transforms == []


@pytest.mark.parametrize(('kind', 'topic'), [
    (TransformBroadcaster, '/tf'), (StaticTransformBroadcaster, '/tf_static')])
def test_ints_are_published_as_the_numbers_they_are(node, heard, kind, topic):
    broadcaster = kind(node)
    wait = heard(topic)
    message = transform('map', 'odom')
    message.transform.translation.x = 3
    message.transform.rotation.w = 1
    broadcaster.sendTransform(message)
    (arrived,) = wait(1)[0].transforms
    assert arrived.transform.translation.x == 3.0
    assert arrived.transform.rotation.w == 1.0
    assert type(message.transform.translation.x) is int, "the caller's value is unchanged"


def test_late_joiner_gets_all_statics_of_all_broadcasters(node, make_node, listen):
    first = StaticTransformBroadcaster(node)
    second = StaticTransformBroadcaster(node)
    third = StaticTransformBroadcaster(make_node('third'))
    first.sendTransform(transform('base', 'a', x=1.0))
    first.sendTransform([transform('base', 'b', x=2.0), transform('base', 'c', x=3.0)])
    second.sendTransform(transform('base', 'd', x=4.0))
    third.sendTransform(transform('base', 'e', x=5.0))
    buffer = listen(make_node('late'))
    for i, child in enumerate('abcde', start=1):
        found = buffer.lookup_transform('base', child, LATEST, PATIENCE)
        assert found.transform.translation.x == i


def test_moving_transforms_are_not_kept_for_late_joiners(talker, node, listen):
    early = listen(node)
    talker.move(transform('map', 'odom', 1.0))
    early.lookup_transform('map', 'odom', LATEST, PATIENCE)
    late = listen(node)
    talker.move(transform('map', 'odom', 2.0), listeners=2)
    found = late.lookup_transform('map', 'odom', LATEST, PATIENCE)
    assert found.header.stamp.sec == 2
    assert late.edges()[0].samples == 1


def test_updated_static_replaces_the_old_one(node, make_node, listen, heard):
    broadcaster = StaticTransformBroadcaster(node)
    wait = heard('/tf_static', static_listener_qos())
    early = listen(make_node('early'))
    broadcaster.sendTransform([transform('base', 'camera', x=1.0), transform('base', 'imu')])
    early.lookup_transform('base', 'imu', LATEST, PATIENCE)
    broadcaster.sendTransform(transform('base', 'camera', x=2.0))
    first, second = wait(2)
    assert [(m.child_frame_id, m.transform.translation.x) for m in second.transforms] == [
        ('camera', 2.0), ('imu', 0.0)]
    assert len(first.transforms) == 2
    broadcaster.sendTransform(transform('base', 'marker'))
    for buffer in (early, listen(make_node('late'))):
        buffer.lookup_transform('base', 'marker', LATEST, PATIENCE)
        assert buffer.lookup('base', 'camera').translation == (2.0, 0.0, 0.0)


def test_static_may_move_to_another_parent(node, make_node, listen):
    broadcaster = StaticTransformBroadcaster(node)
    broadcaster.sendTransform(transform('base', 'camera'))
    broadcaster.sendTransform([transform('arm', 'camera', x=4.0), transform('base', 'arm')])
    buffer = listen(make_node('late'))
    buffer.lookup_transform('arm', 'camera', LATEST, PATIENCE)
    assert [edge.parent for edge in buffer.edges() if edge.child == 'camera'] == ['arm']


def test_static_with_a_slash_is_the_same_as_without(node, make_node, listen):
    broadcaster = StaticTransformBroadcaster(node)
    broadcaster.sendTransform(transform('base', 'camera', x=1.0))
    broadcaster.sendTransform(transform('/base', '/camera', x=2.0))
    broadcaster.sendTransform(transform('base', 'camera', x=3.0))
    buffer = listen(make_node('late'))
    found = buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    assert found.transform.translation.x == 3.0


def test_callers_static_message_is_copied(node, make_node, listen):
    broadcaster = StaticTransformBroadcaster(node)
    message = transform('base', 'camera', x=1.0)
    before = copy.deepcopy(message)
    broadcaster.sendTransform(message)
    assert message == before
    message.child_frame_id = 'lidar'
    message.transform.translation.x = 2.0
    broadcaster.sendTransform(message)
    message.transform.translation.x = 99.0
    message.header.frame_id = 'nonsense'
    broadcaster.sendTransform(transform('base', 'imu', x=3.0))
    buffer = listen(make_node('late'))
    buffer.lookup_transform('base', 'imu', LATEST, PATIENCE)
    placed = {edge.child: buffer.lookup('base', edge.child).x for edge in buffer.edges()}
    assert placed == {'camera': 1.0, 'lidar': 2.0, 'imu': 3.0}


def test_threads_that_send_statics_at_once_lose_none(node, make_node, listen, pool):
    broadcaster = StaticTransformBroadcaster(node)
    names = [f'sensor_{i}' for i in range(60)]
    list(pool.map(lambda name: broadcaster.sendTransform(transform('base', name)), names))
    buffer = listen(make_node('late'))
    for name in names:
        buffer.lookup_transform('base', name, LATEST, PATIENCE)


def test_static_broadcaster_tells_what_it_published_last(node):
    broadcaster = StaticTransformBroadcaster(node)
    assert broadcaster.net_message == TFMessage()
    first, second = transform('map', 'base', 1.0), transform('base', 'arm', 1.0)
    broadcaster.sendTransform(first)
    broadcaster.sendTransform(second)
    assert broadcaster.net_message == TFMessage(transforms=[first, second])
