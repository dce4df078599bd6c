# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors whose hints point at a mistake in the program."""

import pytest
from ros_helpers import lasting, LATEST, transform
import tf_tree_py as tf
from tf_tree_py.dropin.buffer import Buffer as DropIn
from tf_tree_py.dropin.listener import TransformListener as DropInListener

NOTHING = 'Nothing has been received yet'
UNFED = f'{NOTHING}, and no listener feeds this buffer: TransformListener\\(buffer, node\\) does$'
SILENT = f'{NOTHING}: does any node publish on /tf or /tf_static with the same ROS_DOMAIN_ID'


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
