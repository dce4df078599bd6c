"""Publishes samples again: moving ones at a limited rate, static ones all together."""

from collections.abc import Collection
import threading
import time

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write
from tf_tree_py.core.buffer.buffer_core import DEFAULT_MAX_FRAMES
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.ros.topics.qos import dynamic_qos, static_broadcaster_qos

from .pacing import Pacing


class Outlet:
    """Publishes samples as bytes: message objects would cost ten times as much."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        self._node = node
        self._publisher = node.create_publisher(TFMessage, topic, qos)

    def send(self, samples: Collection[Sample]) -> None:
        """Publish one message."""
        try:
            self._publisher.publish(write(samples))
        except Exception as error:  # noqa: B902 - whatever it is, the next must get through
            # When the context ends, rclpy raises anything.
            if self._node.context.ok():
                self._node.get_logger().error(
                    f'{len(samples)} transforms could not be passed on: {error}',
                    throttle_duration_sec=10.0)


class Moving:
    """Passes moving transforms on, each frame at a limited rate; see ``Pacing``."""

    def __init__(self, node: Node, topic: str, rate_hz: float) -> None:
        """
        Make the publisher.

        :param rate_hz: at most, for each frame; 0: as often as it comes.
        """
        self._outlet = Outlet(node, topic, dynamic_qos())
        self._pacing = Pacing(NANOSECONDS_PER_SECOND / rate_hz) if rate_hz else None
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._send_what_waited, name='pacing', daemon=True)
        if self._pacing is not None:
            self._thread.start()

    def take(self, samples: Collection[Sample]) -> None:
        """Pass samples on, now or when their frame may go again."""
        if self._pacing is None:
            self._send(samples)
            return
        with self._changed:
            if self._pacing.next_turn is None:
                self._changed.notify()
            self._send(self._pacing.offer(samples, time.monotonic_ns()))

    def close(self) -> None:
        """End the thread; samples that still wait are not published."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join()

    def _send_what_waited(self) -> None:
        assert self._pacing is not None
        with self._changed:
            while not self._closed:
                now = time.monotonic_ns()
                self._send(self._pacing.due(now))
                turn = self._pacing.next_turn
                self._changed.wait(None if turn is None else min(
                    (turn - now) / NANOSECONDS_PER_SECOND, threading.TIMEOUT_MAX))

    def _send(self, samples: Collection[Sample]) -> None:
        if samples:
            self._outlet.send(samples)


class Static:
    """Passes static transforms on, each time all of them, for late joiners."""

    def __init__(self, node: Node, topic: str) -> None:
        """Make the publisher."""
        self._outlet = Outlet(node, topic, static_broadcaster_qos())
        self._latest: dict[str, Sample] = {}

    def take(self, samples: Collection[Sample]) -> None:
        """Pass samples on at once; for each child the newest counts."""
        for sample in samples:
            # Every message holds all of them: a faulty publisher must not make it grow for ever.
            if sample.child in self._latest or len(self._latest) < DEFAULT_MAX_FRAMES:
                self._latest[sample.child] = sample
        if samples:
            self._outlet.send(self._latest.values())
