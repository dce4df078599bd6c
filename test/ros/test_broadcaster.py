# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages that the broadcasters send."""

import copy

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_helpers import LATEST, PATIENCE, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.ros.topics.qos import static_listener_qos


@pytest.fixture
def heard(make_node, spin):
    """Subscribe to a topic; return a function that waits for a number of its messages."""
    def begin(topic, qos=100):
        messages, node = [], make_node('hearing')
        subscription = node.create_subscription(TFMessage, topic, messages.append, qos)
        spin(node)
        until(subscription.get_publisher_count)

        def wait(count):
            until(lambda: len(messages) >= count)
            return messages

        return wait

    return begin


EACH_KIND = pytest.mark.parametrize(('kind', 'topic', 'durability', 'depth'), [
    (TransformBroadcaster, 'tf', DurabilityPolicy.VOLATILE, 100),
    (StaticTransformBroadcaster, 'tf_static', DurabilityPolicy.TRANSIENT_LOCAL, 1),
], ids=['moving', 'static'])


@EACH_KIND
def test_qos_and_topic_are_those_of_tf2_unless_chosen(make_node, kind, topic, durability, depth):
    def profile(broadcaster, full_name):
        assert broadcaster.pub_tf.topic_name == full_name
        (info,) = node.get_publishers_info_by_topic(full_name)
        on_graph = info.qos_profile
        return broadcaster.pub_tf.qos_profile.depth, on_graph.reliability, on_graph.durability

    node = make_node('talking', namespace='/robot1')
    best_effort = QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert profile(kind(node), f'/{topic}') == (depth, ReliabilityPolicy.RELIABLE, durability)
    chosen = kind(node, best_effort, **{f'{topic}_topic': 'transforms'})
    assert profile(chosen, '/robot1/transforms')[:2] == (7, ReliabilityPolicy.BEST_EFFORT)
    assert kind(node, qos=3).pub_tf.qos_profile.depth == 3


@EACH_KIND
def test_prefix_is_added_on_the_way_out_to_a_copy(node, heard, kind, topic, durability, depth):
    broadcaster = kind(node, frame_prefix='robot1/', shared_frames=['map'])
    wait = heard(f'/{topic}')
    message = transform('map', 'odom', 3.0, x=1.0)
    before = copy.deepcopy(message)
    broadcaster.sendTransform([message, transform('odom', '/base')])
    assert wait(1)[0].transforms == [transform('map', 'robot1/odom', 3.0, x=1.0),
                                     transform('robot1/odom', 'robot1/base')]
    assert message == before


def test_several_transforms_in_any_form_are_one_message(node, heard):
    broadcaster = TransformBroadcaster(node)
    wait = heard('/tf')
    a, b = transform('map', 'odom', x=1.0), transform('odom', 'base', x=2.0)
    for sent in ([a, b], (a, b), (each for each in (a, b)), a, []):
        broadcaster.sendTransform(sent)
    assert [message.transforms for message in wait(5)] == [[a, b], [a, b], [a, b], [a], []]


@EACH_KIND
def test_ints_are_published_as_the_numbers_they_are(node, heard, kind, topic, durability, depth):
    broadcaster = kind(node)
    wait = heard(f'/{topic}')
    message = transform('map', 'odom')
    message.transform.translation.x = 3
    message.transform.rotation.w = 1
    broadcaster.sendTransform(message)
    assert wait(1)[0].transforms == [transform('map', 'odom', x=3.0, w=1.0)]
    assert type(message.transform.translation.x) is int, "the caller's value is unchanged"


def test_late_joiner_gets_all_statics_of_all_broadcasters(node, make_node, listen, pool):
    """The newest of each, also of another parent or with a slash; of threads that send at once."""
    first, second = StaticTransformBroadcaster(node), StaticTransformBroadcaster(node)
    third = StaticTransformBroadcaster(make_node('third'))
    first.sendTransform(transform('base', 'a', x=9.0))
    first.sendTransform([transform('base', 'b', x=9.0), transform('base', 'c', x=3.0)])
    first.sendTransform([transform('c', 'a', x=1.0), transform('/base', '/b', x=9.0)])
    first.sendTransform(transform('base', 'b', x=2.0))
    assert [each.child_frame_id for each in first.net_message.transforms] == ['a', 'b', 'c']
    second.sendTransform(transform('base', 'd', x=4.0))
    names = [f'sensor_{number}' for number in range(60)]
    list(pool.map(lambda name: third.sendTransform(transform('base', name, x=5.0)), names))
    buffer = listen(make_node('late'))
    parents_and_xs = {'a': ('c', 1.0), 'b': ('base', 2.0), 'c': ('base', 3.0), 'd': ('base', 4.0),
                      **dict.fromkeys(names, ('base', 5.0))}
    for child, (parent, x) in parents_and_xs.items():
        found = buffer.lookup_transform(parent, child, LATEST, PATIENCE)
        assert found.transform.translation.x == x
    assert {edge.child: edge.parent for edge in buffer.edges()} == {
        child: parent for child, (parent, _) in parents_and_xs.items()}


def test_updated_static_replaces_the_old_one(node, make_node, listen, heard):
    broadcaster = StaticTransformBroadcaster(node)
    assert broadcaster.net_message == TFMessage()
    wait = heard('/tf_static', static_listener_qos())
    early = listen(make_node('early'))
    imu = transform('base', 'imu')
    camera = transform('base', 'camera', x=2.0)
    for count, sent in enumerate(([transform('base', 'camera', x=1.0), imu], camera), 1):
        broadcaster.sendTransform(sent)
        early.lookup_transform('base', 'imu', LATEST, PATIENCE)
        messages = wait(count)
    first, second = messages
    assert first.transforms == [transform('base', 'camera', x=1.0), imu]
    assert second.transforms == [camera, imu]
    assert broadcaster.net_message == second
    broadcaster.sendTransform(transform('base', 'marker'))
    for buffer in (early, listen(make_node('late'))):
        buffer.lookup_transform('base', 'marker', LATEST, PATIENCE)
        assert buffer.lookup('base', 'camera').translation == (2.0, 0.0, 0.0)


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
