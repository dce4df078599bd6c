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


EACH_KIND = pytest.mark.parametrize(('cls', 'topic', 'durability', 'depth'), [
    (TransformBroadcaster, 'tf', DurabilityPolicy.VOLATILE, 100),
    (StaticTransformBroadcaster, 'tf_static', DurabilityPolicy.TRANSIENT_LOCAL, 1),
], ids=['moving', 'static'])


@EACH_KIND
def test_qos_and_topic_are_those_of_tf2_unless_chosen(make_node, cls, topic, durability, depth):
    def profile(broadcaster, full_name):
        assert broadcaster.pub_tf.topic_name == full_name
        (info,) = node.get_publishers_info_by_topic(full_name)
        on_graph = info.qos_profile
        return broadcaster.pub_tf.qos_profile.depth, on_graph.reliability, on_graph.durability

    node = make_node('talking', namespace='/robot1')
    best_effort = QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert profile(cls(node), f'/{topic}') == (depth, ReliabilityPolicy.RELIABLE, durability)
    chosen = cls(node, best_effort, **{f'{topic}_topic': 'transforms'})
    assert profile(chosen, '/robot1/transforms')[:2] == (7, ReliabilityPolicy.BEST_EFFORT)
    assert cls(node, qos=3).pub_tf.qos_profile.depth == 3


@EACH_KIND
def test_copy_is_published_with_prefix_and_floats(node, heard, cls, topic, durability, depth):
    broadcaster = cls(node, frame_prefix='robot1/', shared_frames=['map'])
    wait = heard(f'/{topic}')
    message = transform('map', 'odom', 3.0)
    message.transform.translation.x, message.transform.rotation.w = 3, 1
    before = copy.deepcopy(message)
    broadcaster.sendTransform([message, transform('odom', '/base')])
    assert wait(1)[0].transforms == [transform('map', 'robot1/odom', 3.0, x=3.0, w=1.0),
                                     transform('robot1/odom', 'robot1/base')]
    assert message == before
    assert type(message.transform.translation.x) is int, "the caller's value is unchanged"


def test_several_transforms_in_any_form_are_one_message(node, heard):
    broadcaster = TransformBroadcaster(node)
    wait = heard('/tf')
    a, b = transform('map', 'odom', x=1.0), transform('odom', 'base', x=2.0)
    for sent in ([a, b], (a, b), (each for each in (a, b)), a, []):
        broadcaster.sendTransform(sent)
    assert [message.transforms for message in wait(5)] == [[a, b], [a, b], [a, b], [a], []]


def test_late_joiner_gets_all_statics_of_all_broadcasters(
        node, make_node, listen, pool, switching_often):
    """Also of threads that send at once."""
    broadcasters = [StaticTransformBroadcaster(each) for each in (node, node, make_node('third'))]
    names = [f'sensor_{number}' for number in range(180)]
    for begin, broadcaster in enumerate(broadcasters):
        list(pool.map(broadcaster.sendTransform, [
            transform('base', name, x=5.0) for name in names[begin::3]]))
    buffer = listen(make_node('late'))
    for name in names:
        found = buffer.lookup_transform('base', name, LATEST, PATIENCE)
        assert found.transform.translation.x == 5.0


def test_static_message_has_the_newest_transform_of_each_child(node, make_node, listen, heard):
    """Each as it was when it was sent: the caller may change and reuse the message."""
    broadcaster = StaticTransformBroadcaster(node)
    assert broadcaster.net_message == TFMessage()
    wait = heard('/tf_static', static_listener_qos())
    early = listen(make_node('early'))
    imu, message = transform('base', 'imu'), transform('base', 'camera', x=1.0)
    broadcaster.sendTransform([message, imu])
    (first,) = wait(1)
    assert first.transforms == [transform('base', 'camera', x=1.0), imu]
    # Another parent, and the same frame with a slash, replace it, too.
    message.transform.translation.x = 2.0
    broadcaster.sendTransform([message, transform('camera', '/imu')])
    _, second = wait(2)
    assert second.transforms == [message, transform('camera', '/imu')]
    message.child_frame_id = 'lidar'
    broadcaster.sendTransform(message)
    assert wait(3)[-1].transforms == [*second.transforms, message]
    message.transform.translation.x = 99.0
    message.header.frame_id = 'nonsense'
    broadcaster.sendTransform(transform('base', 'marker', x=3.0))
    assert broadcaster.net_message == wait(4)[-1]
    for buffer in (early, listen(make_node('late'))):
        buffer.lookup_transform('base', 'marker', LATEST, PATIENCE)
        placed = {edge.child: buffer.lookup('base', edge.child).x for edge in buffer.edges()}
        assert placed == {'camera': 2.0, 'imu': 2.0, 'lidar': 2.0, 'marker': 3.0}
