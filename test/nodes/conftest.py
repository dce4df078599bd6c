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

"""Real rclpy over real DDS, on this machine alone and on a domain of this process alone."""

import threading

from domains import isolate
from programs import executable, PATIENCE_S, Program
import pytest
from rclpy.node import Node
from ros.conftest import context  # noqa: F401
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, TransformListener
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_sample
from tf_tree_py.ros.topics.qos import dynamic_qos, static_listener_qos

# Before rclpy.init, here and in the processes that tests start.
isolate()


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    for thread in threading.enumerate():
        # Zenoh's own threads end a moment after their session.
        if 'pyo3' in thread.name:
            thread.join(PATIENCE_S)
    # That of the alarms lingers for a second, in case there is another.
    left = {thread for thread in threading.enumerate() if not thread.name.endswith(' alarms')}
    assert left <= before


@pytest.fixture
def buffer(context):  # noqa: F811
    """Return a buffer that hears what is published."""
    node = Node('asking', context=context)
    buffer = Buffer()
    with TransformListener(buffer, node):
        yield buffer
    node.destroy_node()


@pytest.fixture
def recorded(context):  # noqa: F811
    """Return what arrives on /tf and /tf_static, message by message, as samples."""
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
def start_program():
    """Start programs that are gone at the end of the test."""
    programs = []

    def start(*command):
        programs.append(Program(*command))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()


@pytest.fixture
def start(start_program):
    """Start executables of this package that are gone at the end of the test."""
    return lambda name, *arguments: start_program(*executable(name, *arguments))
