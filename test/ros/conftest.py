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

from concurrent.futures import ThreadPoolExecutor
import os
import sys
import threading

from domains import isolate
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from ros_helpers import move, PATIENCE_S, SimClock, Talker, until
from tf_tree_py import Buffer, TransformListener

# Before rclpy.init, here and in the processes that tests start.
isolate()


@pytest.fixture(autouse=True)
def no_thread_is_left():
    yield
    for thread in threading.enumerate():
        if thread.name.endswith(' receiver'):
            thread.join(PATIENCE_S)
            assert not thread.is_alive()


@pytest.fixture
def context():
    context = Context()
    rclpy.init(context=context, args=[])
    yield context
    context.try_shutdown()


@pytest.fixture
def buffer():
    """Hold map -> base from 1 s to 2 s; afterwards nobody may wait in it."""
    buffer = Buffer()
    move(buffer, 1.0)
    move(buffer, 2.0)
    yield buffer
    buffer.timeouts.forget_orphans()
    until(lambda: len(buffer.waiting) == 0 and buffer.timeouts.alarms == 0)


@pytest.fixture
def make_node(context):
    """Make nodes that are destroyed at the end of the test."""
    nodes = []

    def make(name, **options):
        nodes.append(Node(name, **{'context': context, **options}))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def node(make_node):
    return make_node('asking')


@pytest.fixture
def talker(make_node):
    return Talker(make_node('talking'))


@pytest.fixture
def listen():
    """Let a buffer listen on a node until the end of the test."""
    listeners = []

    def begin(node, buffer=None, **options):
        buffer = Buffer() if buffer is None else buffer
        listeners.append(TransformListener(buffer, node, **options))
        return buffer

    yield begin
    for listener in listeners:
        listener.close()


@pytest.fixture
def spin(context):
    """Spin nodes in a thread until the end of the test."""
    spinning = []

    def begin(*nodes, kind=SingleThreadedExecutor):
        executor = kind(context=context)
        for node in nodes:
            executor.add_node(node)
        stop = Future()
        # Shutting an executor down from another thread is a race inside rclpy.
        thread = threading.Thread(target=executor.spin_until_future_complete, args=(stop,))
        thread.start()
        spinning.append((executor, stop, thread))
        return executor

    yield begin
    for executor, stop, thread in spinning:
        stop.set_result(None)
        executor.wake()
        thread.join()
        executor.shutdown()


@pytest.fixture
def pool():
    """Threads to ask in while the test goes on."""
    with ThreadPoolExecutor() as threads:
        yield threads


@pytest.fixture
def log_file(tmp_path):
    """Return the file that gets what a test writes to standard error."""
    file = tmp_path / 'stderr'
    file.touch()
    return file


@pytest.fixture
def log(log_file):
    """
    Return what reads all that was written to standard error since the test began.

    ``capfd.readouterr`` empties its file after it has read it: a line that is written in
    between is lost. Here every call reads the whole file, and nothing is taken away.
    """
    return log_file.read_text


# Innermost: pytest turns standard error to a file of its own just before.
@pytest.hookimpl(hookwrapper=True, trylast=True)
def pytest_runtest_call(item):
    file = item.funcargs.get('log_file')
    if file is None:
        yield
        return
    kept, kept_stream = os.dup(2), sys.stderr
    # Appending: the log of ROS and Python write into it side by side.
    with file.open('a', buffering=1) as stream:
        os.dup2(stream.fileno(), 2)
        sys.stderr = stream
        yield
        sys.stderr = kept_stream
        os.dup2(kept, 2)
    os.close(kept)
    # For whoever wants to know why a test failed.
    sys.stderr.write(file.read_text())


@pytest.fixture
def sim_clock(make_node):
    return SimClock(make_node('simulation'))
