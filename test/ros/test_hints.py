# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors whose hints point at a mistake in the program."""

import pytest
from rclpy.node import Node
from ros_helpers import lasting, LATEST, transform
from tf_tree_py import (
    Buffer,
    BufferClient,
    BufferServer,
    LookupException,
    MessageFilter,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformDiagnostics,
    TransformListener,
)
from tf_tree_py.dropin.buffer import Buffer as DropIn
from tf_tree_py.dropin.listener import TransformListener as DropInListener

NOTHING = 'Nothing has been received yet'
UNFED = f'{NOTHING}, and no listener feeds this buffer: TransformListener\\(buffer, node\\) does$'
SILENT = f'{NOTHING}: does any node publish on /tf or /tf_static with the same ROS_DOMAIN_ID'


# --- no data arrives


@pytest.mark.parametrize('timeout', [lasting(0.0), lasting(0.01)])
def test_buffer_without_a_listener_says_so(node, listen, timeout):
    buffer = Buffer()
    with pytest.raises(LookupException, match=UNFED):
        buffer.lookup_transform('map', 'base', LATEST, timeout)
    with pytest.raises(LookupException, match=UNFED):
        buffer.lookup('map', 'base')
    with TransformListener(buffer, node):
        with pytest.raises(LookupException, match=SILENT):
            buffer.lookup_transform('map', 'base', LATEST, timeout)
        assert UNFED[:40] not in buffer.can_transform_core('map', 'base', LATEST)[1]
    with pytest.raises(LookupException, match=UNFED):
        buffer.lookup_transform('map', 'base', LATEST, timeout)
    buffer.set_transform(transform('map', 'base'))
    with pytest.raises(LookupException, match="Did you mean 'base'"):
        buffer.lookup_transform('map', 'bases', LATEST, timeout)


def test_future_of_a_buffer_without_a_listener_says_so():
    with pytest.raises(LookupException, match=UNFED):
        Buffer().wait_for_transform_async('map', 'base', LATEST, lasting(0.0)).result()


def test_drop_in_does_not_know_who_listens():
    with pytest.raises(LookupException, match=f'{NOTHING}$'):
        DropIn().lookup_transform('map', 'base', LATEST)


# --- arguments in the wrong order


@pytest.mark.parametrize(('call', 'match'), [
    (lambda buffer, node: TransformListener(node, buffer),
     r'^TransformListener takes a Buffer .*Node: the buffer comes first, and then the node$'),
    (lambda buffer, node: TransformListener(node), 'the buffer comes first, and then the node$'),
    (lambda buffer, node: TransformListener(buffer, buffer), 'node .*is a Buffer'),
    (lambda buffer, node: DropInListener(node, buffer),
     r'Listener\(buffer, node\): the buffer comes first, and here it is a Node$'),
    (lambda buffer, node: BufferServer(node, buffer), 'the buffer comes first'),
    (lambda buffer, node: TransformDiagnostics(node, buffer), 'the buffer comes first'),
    (lambda buffer, node: BufferServer(buffer, buffer), r'the node is a Buffer'),
    (lambda buffer, node: MessageFilter(node, buffer, 'map', print),
     'MessageFilter takes a Buffer .*: the buffer comes first'),
    (lambda buffer, node: TransformBroadcaster(buffer),
     r'TransformBroadcaster\(node\): the node is a Buffer$'),
    (lambda buffer, node: StaticTransformBroadcaster(buffer), r'Broadcaster\(node\)'),
    (lambda buffer, node: BufferClient(buffer, 'tf2_buffer_server'), r'BufferClient\(node'),
    (lambda buffer, node: Buffer(node), r'cache_time .* is a Node: write Buffer\(node=node\)'),
    (lambda buffer, node: Buffer(node=buffer), 'node is a Buffer'),
])
def test_arguments_that_changed_places_are_told(node, call, match):
    with pytest.raises(TypeError, match=match):
        call(Buffer(), node)


def test_nodes_of_ones_own_are_nodes(context):
    """The checks above raise nothing for a user's own class of node."""
    class Robot(Node):

        def __init__(self):
            super().__init__('robot', context=context)
            self.buffer = Buffer(node=self)
            self.listener = TransformListener(self.buffer, self)
            self.broadcaster = TransformBroadcaster(self)

    robot = Robot()
    robot.listener.close()
    robot.destroy_node()
