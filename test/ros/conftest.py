# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Real rclpy over real DDS, on this machine and this process's domain only."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, ExitStack
import sys
import threading

from filter_helpers import run_callbacks
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from ros_helpers import move, PATIENCE_S, receivers, SIM_TIME, SimClock, Talker, until
from sharing_trees import remove_files
from tf_tree_py import Buffer, TransformListener
from tf_tree_py.ros.buffer.buffer import Buffer as OwnBuffer
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.threads.responses import Responses
from tf_tree_py.ros.topics.reception import reception_of, TOPICS
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import share, SharingTree


@pytest.fixture(autouse=True)
def no_thread_is_left():
    yield
    for thread in receivers():
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
    """Return a buffer with map -> base from 1 s to 2 s; afterwards no thread may wait in it."""
    buffer = Buffer()
    move(buffer, 1.0)
    move(buffer, 2.0)
    yield buffer
    buffer.timeouts.forget_orphans()
    until(lambda: len(buffer.waiting) == 0 and len(buffer.timeouts.alarms) == 0)


@pytest.fixture
def make_node(context):
    """Make nodes that are destroyed at the end of the test."""
    with ExitStack() as nodes:
        def make(name, **options):
            node = Node(name, **{'context': context, **options})
            nodes.callback(node.destroy_node)
            return node

        yield make


@pytest.fixture
def node(make_node):
    return make_node('asking')


@pytest.fixture
def talker(make_node):
    return Talker(make_node('talking'))


@pytest.fixture
def listen(pool):
    """
    Let a buffer listen on a node until the end of the test.

    This ends before ``pool`` waits for its threads: if a test fails, their lookups end with the
    listener.
    """
    with ExitStack() as listeners:
        def begin(node, buffer=None, **options):
            buffer = Buffer() if buffer is None else buffer
            listeners.enter_context(TransformListener(buffer, node, **options))
            return buffer

        yield begin


@pytest.fixture
def spin(context):
    """Spin nodes in a thread until the end of the test."""
    spinning = []

    def begin(*nodes, of_type=SingleThreadedExecutor):
        executor = of_type(context=context)
        for node in nodes:
            executor.add_node(node)
        stop = Future()
        # In rclpy, shutting an executor down from another thread is a race.
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
    # The threads of a MultiThreadedExecutor end when it is collected.
    spinning.clear()


@pytest.fixture
def executor(context):
    """Return an executor that no thread spins."""
    executor = SingleThreadedExecutor(context=context)
    yield executor
    executor.shutdown()


@pytest.fixture
def settle(context, node):
    """Let the node's executor run the callbacks of a message filter, in this thread."""
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield lambda each: run_callbacks(executor, each)
    executor.shutdown()


@pytest.fixture
def pool():
    """Yield threads for lookups while the test continues."""
    with ThreadPoolExecutor() as threads:
        yield threads


@pytest.fixture
def switching_often():
    """Let Python switch threads as often as it can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


@pytest.fixture(params=[True, False], ids=['wait_set', 'executor'])
def use_wait_set(request, monkeypatch):
    """Receive with rclpy's wait set, and without; return which."""
    for cls in (Receiver, Responses):
        monkeypatch.setitem(cls.__init__.__kwdefaults__, 'use_wait_set', request.param)
    return request.param


@pytest.fixture
def sim_clock(make_node):
    return SimClock(make_node('simulation'))


@pytest.fixture
def simulated_buffer(make_node, listen, sim_clock):
    """Return a buffer that listens in simulated time, now 10 s."""
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    return buffer


@pytest.fixture
def woken_events_executor(monkeypatch):
    """Let other threads call an EventsExecutor: the test spins it with timeouts only."""
    monkeypatch.setattr('tf_tree_py.ros.threads.executors.has_broken_queue', lambda: False)


# --- trees for all processes

_OPTIONS = {'tf_topic': '/tf', 'tf_static_topic': '/tf_static', 'static_only': False,
            'frame_prefix': '', 'strip_frame_prefix': '', 'shared_frames': (),
            'frame_filter': None}


class _SharingBuffer(OwnBuffer):
    tree_class = SharingTree


@pytest.fixture
def sharing(context, make_node):
    """Return a function that shares, within a context, what a node receives."""
    places = []

    @contextmanager
    def begin(**options):
        node_options = options.pop('node', {})
        cache_time = options.pop('cache_time', None)
        node = make_node('sharing', **node_options)
        buffer, options = _SharingBuffer(cache_time, node), {**_OPTIONS, **options}
        reception = reception_of(node, **options)
        places.append(Place(context.get_domain_id(), reception[TOPICS]))
        with share(buffer, places[-1], reception) as end, \
                TransformListener(buffer, node, **options):
            buffer.end_of_sharing = end
            yield buffer

    yield begin
    for place in places:
        remove_files(place)


@pytest.fixture
def writer(sharing):
    """Return the buffer whose tree is shared."""
    with sharing() as buffer:
        yield buffer
