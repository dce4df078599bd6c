"""Real rclpy over real DDS, on this machine alone and on a domain of this process alone."""

from concurrent.futures import ThreadPoolExecutor
import threading

from domains import isolate
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from ros_helpers import PATIENCE_S, SimClock, Talker
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
def sim_clock(make_node):
    return SimClock(make_node('simulation'))
