# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors whose hints point at a mistake in the program."""

import gc
import re

from nav_msgs.msg import Odometry
import numpy as np
import pytest
from ros_helpers import lasting, LATEST, PATIENCE, transform, until
import tf_tree_py as tf
from tf_tree_py.core import Pose, Sample, wire
from tf_tree_py.dropin.buffer import Buffer as DropIn
from tf_tree_py.dropin.listener import TransformListener as DropInListener

NOTHING = 'Nothing has been received yet'
UNFED = f'{NOTHING}, and no listener feeds this buffer: TransformListener\\(buffer, node\\) does$'
SIDE = ('No transform has been received yet, and no listener of this buffer reads /tf: '
        'TransformListener(buffer, node) does')
SILENT = f'{NOTHING}: does any node publish on /tf or /tf_static with the same ROS_DOMAIN_ID'
NAN = float('nan')
CURVE = tf.ConstantTwist(0, 10**9, Pose(), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))


# --- no data arrives


@pytest.mark.parametrize('timeout', [lasting(0.0), lasting(0.01)])
def test_buffer_without_a_listener_says_so(node, listen, timeout):
    buffer = tf.Buffer()
    with pytest.raises(tf.LookupException, match=UNFED):
        buffer.lookup_transform('map', 'base', LATEST, timeout)
    with pytest.raises(tf.LookupException, match=UNFED):
        buffer.lookup('map', 'base')
    with tf.TransformListener(buffer, node):
        with pytest.raises(tf.LookupException, match=SILENT):
            buffer.lookup_transform('map', 'base', LATEST, timeout)
        assert UNFED[:40] not in buffer.can_transform_core('map', 'base', LATEST)[1]
    with pytest.raises(tf.LookupException, match=UNFED):
        buffer.lookup_transform('map', 'base', LATEST, timeout)
    with pytest.raises(tf.LookupException, match=UNFED):
        buffer.wait_for_transform_async('map', 'base', LATEST, lasting(0.0)).result()
    buffer.set_transform(transform('map', 'base'))
    with pytest.raises(tf.LookupException, match="Did you mean 'base'"):
        buffer.lookup_transform('map', 'bases', LATEST, timeout)


# --- what feeds a buffer, and is no TransformListener

def hint(buffer):
    with pytest.raises(tf.LookupException) as raised:
        buffer.lookup_transform('map', 'nowhere', LATEST)
    return str(raised.value).partition('\n')[2]


SIDE_LISTENERS = {
    'covariances': lambda buffer, node: tf.CovarianceListener(buffer, node),
    'gyroscope': lambda buffer, node: tf.GyroListener(buffer, node, 'base')}


@pytest.mark.parametrize('listen', SIDE_LISTENERS.values(), ids=SIDE_LISTENERS)
def test_listener_to_another_topic_feeds_the_buffer(node, context, listen):
    buffer = tf.Buffer()
    with listen(buffer, node):
        assert hint(buffer) == SIDE
        with tf.TransformListener(buffer, node):
            assert hint(buffer).startswith(SILENT)
        assert hint(buffer) == SIDE
    assert re.search(UNFED, hint(buffer))
    left = listen(buffer, node)
    assert hint(buffer) == SIDE
    del left
    gc.collect()
    until(lambda: re.search(UNFED, hint(buffer)))
    ended = listen(buffer, node)
    context.shutdown()
    until(lambda: re.search(UNFED, hint(buffer)))
    ended.close()


def odometry(x):
    message = Odometry(child_frame_id='base')
    message.header.frame_id, message.header.stamp.sec = 'odom', 1
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, 1.0
    message.pose.covariance = np.eye(6).ravel()
    return message


@pytest.mark.parametrize(('x', 'expected'), [(1.0, 'Known: base, odom'), (NAN, 'refused')])
def test_buffer_of_an_odometry_is_fed_before_and_after_it_arrives(node, talker, x, expected):
    buffer = tf.Buffer()
    with tf.TransformListener(buffer, node) as listener:
        listener.subscribe(Odometry, 'wheels')
        assert hint(buffer).startswith(
            f'{NOTHING}: does any node publish on /tf, /tf_static or /wheels with the same')
        publisher = talker.node.create_publisher(Odometry, 'wheels', 1)
        talker.until_heard(publisher)
        publisher.publish(odometry(x))
        until(lambda: expected in hint(buffer))
    assert expected in hint(buffer)


@pytest.mark.parametrize(('x', 'expected'), [(1.0, 'Known: base, odom'), (NAN, 'refused')])
def test_listener_that_closed_after_it_had_fed_the_buffer_is_not_missed(
        node, talker, x, expected):
    buffer = tf.Buffer()
    with tf.TransformListener(buffer, node):
        talker.move(transform('odom', 'base', x=x))
        until(lambda: expected in hint(buffer))
    assert expected in hint(buffer)


def test_shared_buffer_is_fed(make_node):
    node = make_node('sharing')
    buffer = tf.shared_buffer(node)
    assert hint(buffer).startswith(SILENT)
    node.destroy_node()
    until(lambda: re.search(UNFED, hint(buffer)))


def test_client_repeats_the_hint_of_the_servers_buffer(node, make_node, spin):
    buffer, home = tf.Buffer(), make_node('home')
    with (tf.CovarianceListener(buffer, home), tf.BufferServer(buffer, home, 'transforms'),
          tf.BufferClient(node, 'transforms') as client):
        spin(home)
        assert client.wait_for_server(PATIENCE)
        assert SIDE in hint(client)


DOORS = {
    'set_transform': lambda buffer, x: buffer.set_transform(
        transform('odom', 'base', x=x), 'me'),
    'set_transform_static': lambda buffer, x: buffer.set_transform_static(
        transform('odom', 'base', x=x), 'me'),
    'insert': lambda buffer, x: buffer.insert('odom', 'base', 1, Pose(x), strict=False),
    'insert_many': lambda buffer, x: buffer.insert_many(
        [Sample('odom', 'base', 1, Pose(x))], strict=False),
    'insert_track': lambda buffer, x: buffer.insert_track(
        'odom', 'base', [1, 2], [Pose(x)] * 2, strict=False),
    'insert_curve': lambda buffer, x: buffer.insert_curve(
        'odom' if x == 1.0 else 'base', 'base', CURVE, strict=False),
    'insert_from': lambda buffer, x: buffer.insert_from('wheels', 'odom', 'base', 1, Pose(x)),
    'a bag': lambda buffer, x: buffer.insert_batch(wire.read(wire.write([
        Sample('odom', 'base', 1, Pose(x))]))),
}


@pytest.mark.parametrize('door', DOORS.values(), ids=DOORS)
@pytest.mark.parametrize('make', [tf.Buffer, DropIn])
def test_buffer_that_received_anything_does_not_miss_a_listener(make, door):
    buffer = make()
    door(buffer, NAN)
    assert hint(buffer) == ('All that was received was refused: the log and statistics() have '
                            'the reasons')
    door(buffer, 1.0)
    assert hint(buffer) == 'Known: base, odom'
    buffer.remove_frame('base')
    buffer.remove_frame('odom')
    assert hint(buffer) == 'All frames were removed'


def test_drop_in_does_not_know_who_listens():
    with pytest.raises(tf.LookupException, match=f'{NOTHING}$'):
        DropIn().lookup_transform('map', 'base', LATEST)


# --- arguments in the wrong order


@pytest.mark.parametrize(('call', 'match'), [
    (lambda buffer, node: tf.TransformListener(node, buffer),
     r'^TransformListener takes a Buffer .*Node: the buffer comes first, and then the node$'),
    (lambda buffer, node: tf.TransformListener(node), 'buffer comes first, and then the node$'),
    (lambda buffer, node: tf.TransformListener(buffer, buffer), 'node .*is a Buffer'),
    (lambda buffer, node: DropInListener(node, buffer),
     r'Listener\(buffer, node\): the buffer comes first, and here it is a Node$'),
    (lambda buffer, node: tf.BufferServer(node, buffer), 'the buffer comes first'),
    (lambda buffer, node: tf.TransformDiagnostics(node, buffer), 'the buffer comes first'),
    (lambda buffer, node: tf.BufferServer(buffer, buffer), r'the node is a Buffer'),
    (lambda buffer, node: tf.MessageFilter(node, buffer, 'map', print),
     'MessageFilter takes a Buffer .*: the buffer comes first'),
    (lambda buffer, node: tf.TransformBroadcaster(buffer),
     r'TransformBroadcaster\(node\): the node is a Buffer$'),
    (lambda buffer, node: tf.StaticTransformBroadcaster(buffer), r'Broadcaster\(node\)'),
    (lambda buffer, node: tf.BufferClient(buffer, 'tf2_buffer_server'), r'BufferClient\(node'),
    (lambda buffer, node: tf.Buffer(node), r'cache_time .* is a Node: write Buffer\(node=node\)'),
    (lambda buffer, node: tf.Buffer(node=buffer), 'node is a Buffer'),
])
def test_arguments_that_changed_places_are_told(node, call, match):
    with pytest.raises(TypeError, match=match):
        call(tf.Buffer(), node)
