"""tf2's buffers where they differ from ours: two classes, and setters that return nothing."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.ros.buffer.buffer import Buffer as OurBuffer

from .executor_waker import Waker


class BufferCore(OurBuffer):
    """``tf2_py.BufferCore``: what is refused, the log and ``statistics()`` tell."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None,
                 **options: Any) -> None:
        """
        Make an empty buffer.

        :param cache_time: how much history each edge keeps; 10 s unless given.
        :param options: those of ``tf_tree_py.Buffer``.
        """
        super().__init__(cache_time, node, **options)
        self._wakers: dict[Waker, None] = {}

    def _when_empty(self) -> str:
        # Listeners as tf2 has them do not tell a buffer of themselves.
        return 'Nothing has been received yet'

    def set_transform(self, transform: TransformStamped,  # type: ignore[override]
                      authority: str) -> None:
        """Take a transform that moves."""
        super().set_transform(transform, authority)

    def set_transform_static(self, transform: TransformStamped,  # type: ignore[override]
                             authority: str) -> None:
        """Take a transform that is valid at all times."""
        super().set_transform_static(transform, authority)

    def insert_batch(self, *batch: Any) -> list[Incident]:
        """Take what a listener received, and wake those who spin for it."""
        try:
            return super().insert_batch(*batch)
        finally:
            for waker in list(self._wakers):
                waker.wake()

    def _is_simulated(self) -> bool:
        # To tf2 a Time is its nanoseconds, and its programs make such of any clock type.
        return False

    def wake_executor_of(self, node: Node) -> Callable[[], None]:
        """
        Make ``rclpy.spin_once(node)`` return when something was received, as tf2's does.

        For programs that wait for a transform in a loop of it.

        :return: what ends it.
        """
        waker = Waker(node)
        self._wakers[waker] = None

        def end() -> None:
            self._wakers.pop(waker, None)

        return end


class Buffer(BufferCore):
    """``tf2_ros.Buffer``."""
