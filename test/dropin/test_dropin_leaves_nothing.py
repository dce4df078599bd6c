# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What listeners of the drop-in leave behind on the node of a program: nothing."""

import pytest
from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.listener import TransformListener


class Overriding(TransformListener):
    """As people write it who want to be told."""

    def callback(self, data):
        super().callback(data)


def entities(node):
    return [list(kind) for kind in (node.subscriptions, node.guards, node.waitables)]


@pytest.mark.parametrize('kind', [TransformListener, Overriding])
def test_listener_that_is_unregistered_leaves_nothing_on_its_node(node, kind):
    buffer = Buffer()
    before = entities(node)
    for _ in range(3):
        kind(buffer, node).unregister()
    assert entities(node) == before
    assert not buffer._wakers


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
