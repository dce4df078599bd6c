# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The differences of tf2's buffers from this package's.

There are two classes, the setters return nothing, and there are tf2's own velocities and the
methods with a leading underscore, which tf2's tools and some programs call.
"""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core.errors import ArgumentTypeException, TransformException
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.reports import plain_text
from tf_tree_py.ros.buffer.buffer import Buffer as OurBuffer
from tf_tree_py.ros.buffer.interface import NO_TIME
from tf_tree_py.ros.messages.convert import as_nanoseconds

from .debug_text import tf2_text
from .executor_waker import Waker
from .velocity import lookup_velocity


class BufferCore(OurBuffer):
    """``tf2_py.BufferCore``; the log and ``statistics()`` show the refused transforms."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None,
                 **options: Any) -> None:
        """
        Make an empty buffer.

        :param cache_time: the length of the history of each edge; 10 s unless given.
        :param options: those of ``tf_tree_py.Buffer``.
        """
        super().__init__(cache_time, node, **options)
        self._wakers: dict[Waker, None] = {}

    def _when_empty(self, fed: bool) -> str:
        # tf2's own kind of listener does not register with the buffer.
        return 'Nothing has been received yet'

    def set_transform(self, transform: TransformStamped,  # type: ignore[override]
                      authority: str) -> None:
        """Insert a moving transform."""
        super().set_transform(transform, authority)

    def set_transform_static(self, transform: TransformStamped,  # type: ignore[override]
                             authority: str) -> None:
        """Insert a transform that is valid at all times."""
        super().set_transform_static(transform, authority)

    def insert_batch(self, *batch: Any, **options: Any) -> list[Incident]:
        """Insert a batch that a listener received, and let ``rclpy.spin_once`` return."""
        try:
            return super().insert_batch(*batch, **options)
        finally:
            for waker in list(self._wakers):
                waker.wake()

    def _is_simulated(self) -> bool:
        # tf2 only reads the nanoseconds of a Time, so its programs use any clock type.
        return False

    def wake_executor_of(self, node: Node) -> Callable[[], None]:
        """
        Make ``rclpy.spin_once(node)`` return when a message was received, as tf2's does.

        Some programs wait for a transform in a loop of ``spin_once``.

        :return: a function that stops this.
        """
        waker = Waker(node)
        self._wakers[waker] = None

        def end() -> None:
            self._wakers.pop(waker, None)

        return end

    # --- results as in tf2

    def can_transform_core(  # type: ignore[override]  # 1 or 0, as in tf2
            self, target_frame: str, source_frame: str, time: Any) -> tuple[int, str]:
        """Return whether the lookup would succeed, as 1 or 0, and the reason if not."""
        return _answered(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def can_transform_full_core(  # type: ignore[override]  # likewise
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str) -> tuple[int, str]:
        """Return whether the lookup between two times would succeed, 1 or 0, and the reason."""
        return _answered(lambda: self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame))

    def can_transform(  # type: ignore[override]  # likewise
            self, target_frame: str, source_frame: str, time: Any, timeout: Any = NO_TIME,
            return_debug_tuple: bool = False) -> bool | tuple[int, str]:
        """Return whether a lookup would succeed, or the result of ``can_transform_core``."""
        can = super().can_transform(target_frame, source_frame, time, timeout)
        if not return_debug_tuple:
            return bool(can)
        return (1, '') if can else self.can_transform_core(target_frame, source_frame, time)

    def can_transform_full(  # type: ignore[override]  # likewise
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = NO_TIME,
            return_debug_tuple: bool = False) -> bool | tuple[int, str]:
        """Return whether a lookup between two times would succeed, likewise."""
        times = (target_frame, target_time, source_frame, source_time, fixed_frame)
        can = super().can_transform_full(*times, timeout)
        if not return_debug_tuple:
            return bool(can)
        return (1, '') if can else self.can_transform_full_core(*times)

    # --- methods of tf2 only

    def lookupVelocityCore(self, tracking_frame: str, observation_frame: str, time: Any,
                           averaging_interval: Any) -> tuple[Vector3, Vector3]:
        """
        Return linear and angular velocity as tf2 computes them, its errors included.

        ``lookup_twist`` is correct also where frames rotate.
        """
        velocity = lookup_velocity(self, tracking_frame, observation_frame,
                                   self._as_stamp(time), as_nanoseconds(averaging_interval))
        return velocity.linear, velocity.angular

    def lookupVelocityFullCore(self, tracking_frame: str, observation_frame: str,
                               reference_frame: str, reference_point: Vector3,
                               reference_point_frame: str, time: Any,
                               averaging_interval: Any) -> tuple[Vector3, Vector3]:
        """Return the velocity of a point, in the axes of a reference frame, likewise."""
        velocity = lookup_velocity(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), reference_frame=reference_frame,
            reference_point=reference_point, reference_point_frame=reference_point_frame)
        return velocity.linear, velocity.angular

    def _allFramesAsDot(self, time: Any = None) -> str:
        return plain_text.as_dot(self.edges())

    def _frameExists(self, frame_id: str) -> bool:
        return frame_id in self.frames()

    def _getFrameStrings(self) -> list[str]:
        return self.frames()

    def _chain(self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
               fixed_frame: str) -> list[str]:
        """Return the frames from the source through the fixed one to the target."""
        to_fixed = self.frames_between(fixed_frame, source_frame, self._as_stamp(source_time))
        return to_fixed[:-1] + self.frames_between(
            target_frame, fixed_frame, self._as_stamp(target_time))


class Buffer(BufferCore):
    """``tf2_ros.Buffer``."""


def _answered(lookup: Callable[[], object]) -> tuple[int, str]:
    try:
        lookup()
    except ArgumentTypeException:
        raise
    except TransformException as error:
        return 0, tf2_text(error)
    return 1, ''
