# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Listeners of the drop-in leave nothing behind on the node of a program."""

import gc
import weakref

import pytest
from rclpy.node import Node
from ros_helpers import until
from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.listener import TransformListener


class Overriding(TransformListener):
    """As in programs that process each message."""

    def callback(self, data):
        super().callback(data)


def entities(node):
    return [list(each) for each in (node.subscriptions, node.guards, node.waitables, node.timers)]


@pytest.mark.parametrize('cls', [TransformListener, Overriding])
def test_listener_that_is_unregistered_leaves_nothing_on_its_node(node, cls):
    buffer = Buffer()
    before = entities(node)
    for _ in range(3):
        cls(buffer, node).unregister()
    assert entities(node) == before
    assert not buffer._spinning_threads


def test_listener_that_moves_to_its_node_wakes_nobody_besides(node):
    buffer = Buffer()
    guards = list(node.guards)
    listener = TransformListener(buffer, node)
    assert listener.tf_sub in list(node.subscriptions)
    assert list(node.guards) == guards
    listener.unregister()


def test_listener_that_is_unregistered_subscribes_no_more(node):
    listener = TransformListener(Buffer(), node)
    before = list(node.subscriptions)
    listener.unregister()
    listener.buffer = Buffer()
    assert not hasattr(listener, 'tf_sub')
    assert list(node.subscriptions) == before


def test_static_listener_has_no_subscription_to_tf(node):
    listener = TransformListener(Buffer(), node, static_only=True)
    assert not hasattr(listener, 'tf_sub')
    assert listener.tf_static_sub in list(node.subscriptions)
    listener.unregister()


def test_node_that_is_dropped_ends_the_listener_and_the_buffer(context):
    def use():
        node = Node('dropped', context=context)
        buffer = Buffer()
        TransformListener(buffer, node)
        return weakref.ref(node), weakref.ref(buffer)

    references = use()
    until(lambda: gc.collect() is not None and not any(each() for each in references))
