# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Real rclpy over real DDS, on this machine and this process's domain only."""

import threading

from programs import executable, PATIENCE_S
import pytest
from rclpy.node import Node
from ros.conftest import context  # noqa: F401
from sharing_trees import remove_files
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, TransformListener
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_sample
from tf_tree_py.ros.topics.qos import dynamic_qos, static_listener_qos
from tf_tree_py.shared.place import Place


@pytest.fixture(scope='session', autouse=True)
def no_lock_is_left():
    """Remove the lock that ``tf_share`` leaves in the domain of this process."""
    yield
    remove_files(Place())


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    # The thread of the alarms stays for a second, for later alarms. Others end a moment later:
    # Zenoh's after their session, and those of a node that Kilted's Context.shutdown destroys.
    left = [thread for thread in set(threading.enumerate()) - before
            if not thread.name.endswith(' alarms')]
    for thread in left:
        thread.join(PATIENCE_S)
    assert not [thread.name for thread in left if thread.is_alive()]


@pytest.fixture
def buffer(context):  # noqa: F811
    """Return a buffer that receives the published transforms."""
    node = Node('asking', context=context)
    buffer = Buffer()
    with TransformListener(buffer, node):
        yield buffer
    node.destroy_node()


@pytest.fixture
def robot_node(context):  # noqa: F811
    """Return a node that is spun."""
    node = Node('robot', context=context)
    with spun_in_background(node):
        yield node


@pytest.fixture
def recorded(context):  # noqa: F811
    """Return the received messages of /tf and /tf_static, each as a list of samples."""
    node = Node('recorder', context=context)
    messages = {'/tf': [], '/tf_static': []}
    for (topic, heard), qos in zip(messages.items(), (dynamic_qos(), static_listener_qos()),
                                   strict=True):
        node.create_subscription(
            TFMessage, topic, lambda message, heard=heard: heard.append(
                [as_sample(transform)._replace(parent=transform.header.frame_id)
                 for transform in message.transforms]), qos)
    with spun_in_background(node):
        yield messages


@pytest.fixture
def start(start_program):
    """Start executables of this package that are killed at the end of the test."""
    return lambda name, *arguments: start_program(*executable(name, *arguments))
