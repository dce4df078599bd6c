# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer in ROS: messages in, messages out, its service and its listing."""

from contextlib import suppress

from domains import claim
from inputs import for_each
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import at, lasting, LATEST, PATIENCE, PATIENCE_S, result_of, transform, until
from tf2_msgs.srv import FrameGraph
import tf_tree_py as tf
import yaml


@pytest.fixture
def buffer():
    buffer = tf.Buffer()
    for second in (1.0, 2.0, 3.0):
        buffer.set_transform(transform('map', 'odom', second, x=second), '/localiser')
    for second in (2.0, 4.0):
        buffer.set_transform(transform('odom', 'base', second), '/odometry')
    buffer.set_transform_static(transform('base', 'camera', x=0.5), '/calibration')
    return buffer


@for_each(time=[
    Time(), Time(seconds=0).to_msg(), transform('a', 'b', 0.0).header.stamp, Duration()])
def test_time_zero_is_the_latest_common_time(buffer, time):
    assert buffer.lookup_transform('map', 'camera', time).header.stamp.sec == 3
    assert buffer.get_latest_common_time('map', 'camera') == Time(seconds=3)
    assert buffer.get_latest_common_time('base', 'camera') == Time(), 'which is static'


def test_transform_can_be_had_at_a_stamp_and_between_two(buffer):
    assert buffer.can_transform('map', 'odom', transform('a', 'b', 2.0).header.stamp)
    assert buffer.can_transform_full('odom', at(3.0), 'odom', at(1.0), 'map')
    assert not buffer.can_transform_full('odom', at(3.0), 'odom', at(0.5), 'map')


def test_frame_to_itself_is_the_identity_also_when_nobody_knows_it(buffer):
    found = buffer.lookup_transform('nowhere', 'nowhere', at(5.0))
    assert found == transform('nowhere', 'nowhere', 5.0)
    assert buffer.lookup_transform('odom', 'odom', LATEST).header.stamp.sec == 3


def test_messages_are_shared_with_no_caller(buffer):
    message = transform('map', 'odom', 5.0, x=5.0)
    buffer.set_transform(message, 'me')
    message.transform.translation.x = 99.0
    message.header.frame_id = 'elsewhere'
    for _ in range(2):
        found = buffer.lookup_transform('map', 'odom', LATEST)
        assert (found.transform.translation.x, found.header.stamp.sec) == (5.0, 5)
        found.transform.translation.x = 99.0
        found.header.stamp.sec = 99


def test_cache_time_is_a_duration_or_unlimited():
    assert tf.Buffer().cache_time == 10_000_000_000
    assert tf.Buffer(Duration(seconds=2.5)).cache_time == 2_500_000_000
    assert tf.Buffer(cache_time=lasting(1.0)).cache_time == 1_000_000_000
    for given, meant in ((3 * 10**9, 'nanoseconds=3000000000'), (3, 'seconds=3'),
                         (0.5, 'seconds=0.5')):
        with pytest.raises(TypeError, match=rf'cache_time=.*Duration\({meant}\)'):
            tf.Buffer(cache_time=given)
    assert tf.Buffer(cache_time=tf.UNLIMITED).cache_time == tf.UNLIMITED


# --- listing


def test_frames_are_listed_as_tf2_lists_them(buffer):
    assert buffer.all_frames_as_string() == (
        'Frame odom exists with parent map.\n'
        'Frame base exists with parent odom.\n'
        'Frame camera exists with parent base.\n')
    edges = yaml.safe_load(buffer.all_frames_as_yaml())
    assert list(edges['odom']) == ['parent', 'broadcaster', 'rate', 'most_recent_transform',
                                   'oldest_transform', 'buffer_length']
    assert {child: tuple(edge.values()) for child, edge in edges.items()} == {
        'odom': ('map', '/localiser', 1.5, 3.0, 1.0, 2.0),
        'base': ('odom', '/odometry', 1.0, 4.0, 2.0, 2.0),
        'camera': ('base', '/calibration', 10_000.0, 0.0, 0.0, 0.0)}


def test_listing_of_an_empty_buffer_is_that_of_tf2():
    buffer = tf.Buffer()
    assert buffer.all_frames_as_yaml() == '[]'
    buffer.insert('map', 'base', 1, tf.Pose())
    buffer.clear()
    assert buffer.all_frames_as_yaml() == ''


@pytest.mark.parametrize('namespace', ['', '/robot'])
def test_frames_are_served(make_node, spin, namespace):
    node = make_node('holding', namespace=namespace)
    buffer = tf.Buffer(node=node)
    asking = make_node('asking')
    client = asking.create_client(FrameGraph, f'{namespace}/tf2_frames')
    spin(node)
    spin(asking)
    assert client.wait_for_service(PATIENCE_S)

    def ask():
        return result_of(client.call_async(FrameGraph.Request())).frame_yaml

    assert ask() == '[]'
    buffer.set_transform(transform('map', 'odom', 3.0), '/localiser')
    assert ask() == buffer.all_frames_as_yaml()
    assert yaml.safe_load(ask())['odom']['parent'] == 'map'


@pytest.fixture
def own_domain(monkeypatch):
    """Leave the domain of the other tests, whose entities may not have disappeared yet."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(claim()))


def test_buffer_without_a_node_serves_nothing(own_domain, node):
    tf.Buffer()
    assert 'tf2_frames' not in str(node.get_service_names_and_types())


def test_listing_names_the_publishing_node(node, listen, talker):
    buffer = listen(node)
    talker.move(transform('map', 'odom', 3.0))
    until(lambda: "broadcaster: '/talking'" in buffer.all_frames_as_yaml())


def test_frame_that_is_no_string_is_no_answer(buffer):
    for ask in (buffer.can_transform, buffer.can_transform_core, buffer.lookup_transform):
        with pytest.raises(TypeError, match='a frame name in a query must be a string'):
            ask(None, 'odom', LATEST)


@for_each(mistake=[
    lambda buffer: buffer.lookup_transform('map', 'odom', 0),
    lambda buffer: buffer.lookup_transform('map', 'odom', 0.0, PATIENCE),
    lambda buffer: buffer.lookup_transform('map', 'odom', LATEST, timeout=1.0),
    lambda buffer: buffer.lookup_transform('map', 'odom', LATEST, timeout=None),
    lambda buffer: buffer.lookup_transform_full('map', 0, 'odom', LATEST, 'map'),
    lambda buffer: buffer.lookup_transform_core('map', 'odom', 0.0),
    lambda buffer: buffer.wait_for_transform_async('map', 'odom', 0.0),
    lambda buffer: buffer.wait_for_transform_async('map', 'odom', at(9.0), 1.0),
    # Otherwise a loop that waits for True would never end, without giving the reason.
    lambda buffer: buffer.can_transform('map', 'odom', 0.0),
    lambda buffer: buffer.can_transform('map', 'odom', LATEST, 1.0, return_debug_tuple=True),
    lambda buffer: buffer.can_transform_full('map', LATEST, 'odom', 1, 'map'),
])
def test_mistake_of_the_programmer_is_not_swallowed_as_a_missing_transform(mistake):
    # As in nodes that wait for a transform.
    what = 'is not a (time|duration)'
    with pytest.raises(TypeError, match=what), suppress(tf.TransformException):
        mistake(tf.Buffer())
