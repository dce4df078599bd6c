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

"""
tf2's buffers where they differ from ours.

There are two classes, the setters return nothing, and there are tf2's own velocities and
the methods with a leading underscore, which tf2's tools and some programs call.
"""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.telling import report
from tf_tree_py.ros.buffer.buffer import Buffer as OurBuffer
from tf_tree_py.ros.messages.convert import as_nanoseconds

from .executor_waker import Waker
from .velocity import lookup_velocity


class BufferCore(OurBuffer):
    """``tf2_py.BufferCore``; the log and ``statistics()`` say what was refused."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None,
                 **options: Any) -> None:
        """
        Make an empty buffer.

        :param cache_time: how much history each edge keeps; 10 s unless given.
        :param options: those of ``tf_tree_py.Buffer``.
        """
        super().__init__(cache_time, node, **options)
        self._wakers: dict[Waker, None] = {}

    def _when_empty(self, fed: bool) -> str:
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
        """Take what a listener received, and let ``rclpy.spin_once`` return."""
        try:
            return super().insert_batch(*batch)
        finally:
            for waker in list(self._wakers):
                waker.wake()

    def _is_simulated(self) -> bool:
        # tf2 only reads the nanoseconds of a Time, so its programs use any clock type.
        return False

    def wake_executor_of(self, node: Node) -> Callable[[], None]:
        """
        Make ``rclpy.spin_once(node)`` return when something was received, as tf2's does.

        Some programs wait for a transform in a loop of ``spin_once``.

        :return: call it to stop this.
        """
        waker = Waker(node)
        self._wakers[waker] = None

        def end() -> None:
            self._wakers.pop(waker, None)

        return end

    # --- what only tf2 has

    def lookupVelocityCore(self, tracking_frame: str, observation_frame: str, time: Any,
                           averaging_interval: Any) -> tuple[Vector3, Vector3]:
        """
        Return linear and angular velocity as tf2 computes them, its errors included.

        ``lookup_twist`` is right also where frames turn.
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
        return report.as_dot(self.edges())

    def _frameExists(self, frame_id: str) -> bool:
        return frame_id in self.frames()

    def _getFrameStrings(self) -> list[str]:
        return self.frames()

    def _chain(self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
               fixed_frame: str) -> list[str]:
        """Return the frames from the source over the fixed one to the target."""
        to_fixed = self.frames_between(fixed_frame, source_frame, self._as_stamp(source_time))
        return to_fixed[:-1] + self.frames_between(
            target_frame, fixed_frame, self._as_stamp(target_time))


class Buffer(BufferCore):
    """``tf2_ros.Buffer``."""
