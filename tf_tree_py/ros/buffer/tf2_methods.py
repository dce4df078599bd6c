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

"""The methods of ``tf2_py.BufferCore`` under their own names, in messages and ROS times."""

from typing import Any

from geometry_msgs.msg import TransformStamped, VelocityStamped
import numpy.typing as npt
from rclpy.clock_type import ClockType
from rclpy.time import Time
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.errors import InvalidArgumentException, TransformException
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.telling import report
from tf_tree_py.core.twist import lookup_twist, lookup_twist_many, ORIGIN

from .twists import velocity_stamped
from ..messages.convert import as_nanoseconds, as_stamp, transform_stamped
from ..messages.times import checked_ros_stamp, RosSnapshot


class CoreApi(BufferCore):
    """What tf2_py offers, and twists: lookups that never wait, and listings."""

    def _is_simulated(self) -> bool:
        """Return whether stamps are of another clock than the system's."""
        return False

    def _as_stamp(self, time: Any) -> int:
        return as_stamp(time, self._is_simulated)

    def _stamp_of(self, stamp: Any) -> int:
        return checked_ros_stamp(stamp, self._is_simulated)

    def snapshot(self) -> RosSnapshot:
        """Return a copy of everything as it is now, for several lookups that must agree."""
        with self._lock:
            return RosSnapshot(self._tree.copy(), self._is_simulated())

    def lookup_transform_core(self, target_frame: str, source_frame: str,
                              time: Any) -> TransformStamped:
        """Return the transform from source to target, or raise at once."""
        stamp, pose = self.lookup_stamped(target_frame, source_frame, self._as_stamp(time))
        return transform_stamped(target_frame, source_frame, stamp, pose)

    def lookup_transform_full_core(self, target_frame: str, target_time: Any, source_frame: str,
                                   source_time: Any, fixed_frame: str) -> TransformStamped:
        """Return the transform between two times, or raise at once."""
        stamp, pose = self.lookup_full_stamped(
            target_frame, self._as_stamp(target_time), source_frame,
            self._as_stamp(source_time), fixed_frame)
        return transform_stamped(target_frame, source_frame, stamp, pose)

    def can_transform_core(self, target_frame: str, source_frame: str,
                           time: Any) -> tuple[bool, str]:
        """Return whether the lookup would succeed, and if not, why."""
        try:
            self.lookup_stamped(target_frame, source_frame, self._as_stamp(time))
        except TransformException as error:
            return (False, str(error))
        return (True, '')

    def can_transform_full_core(self, target_frame: str, target_time: Any, source_frame: str,
                                source_time: Any, fixed_frame: str) -> tuple[bool, str]:
        """Return whether the lookup between two times would succeed, and if not, why."""
        try:
            self.lookup_transform_full_core(
                target_frame, target_time, source_frame, source_time, fixed_frame)
        except TransformException as error:
            return (False, str(error))
        return (True, '')

    def lookup_twist(self, tracking_frame: str, observation_frame: str, time: Any,
                     averaging_interval: Any, *, reference_frame: str | None = None,
                     reference_point: Vector3 = ORIGIN,
                     reference_point_frame: str | None = None) -> VelocityStamped:
        """
        Return how fast one frame moves as another sees it; see ``core.twist.lookup_twist``.

        :param time: an rclpy ``Time``, or a message's; zero is the latest.
        :param averaging_interval: an rclpy ``Duration``.
        """
        velocity = lookup_twist(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), reference_frame=reference_frame,
            reference_point=reference_point, reference_point_frame=reference_point_frame)
        return velocity_stamped(velocity, tracking_frame, observation_frame, reference_frame)

    def lookup_twist_many(self, tracking_frame: str, observation_frame: str,
                          stamps: npt.ArrayLike, averaging_interval: Any,
                          **reference: Any) -> Array:
        """
        Return the twists at many stamps; see ``core.twist.lookup_twist_many``.

        :param stamps: (N,) integer nanoseconds.
        :param averaging_interval: an rclpy ``Duration``.
        :param reference: as ``lookup_twist`` has it.
        :return: (N, 6): linear velocity, metres a second, and angular, radians a second.
        """
        return lookup_twist_many(self, tracking_frame, observation_frame, stamps,
                                 as_nanoseconds(averaging_interval), **reference)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """
        Return the newest time for which all edges between two frames have data.

        :raises InvalidArgumentException: it lies before 1970, where rclpy has no ``Time``;
            ``latest_common_time`` tells it.
        """
        # In simulated time one that can be looked up; else as tf2's, for it is compared.
        kind = ClockType.ROS_TIME if self._is_simulated() else ClockType.SYSTEM_TIME
        stamp = self.latest_common_time(target_frame, source_frame)
        if stamp < 0:
            raise InvalidArgumentException(
                f'The latest common time of {target_frame!r} and {source_frame!r} is '
                f'{format_stamp(stamp)} s, and a Time of rclpy cannot be negative',
                hint='latest_common_time() tells it in nanoseconds. Most likely a publisher has a '
                     'broken clock')
        return Time(nanoseconds=stamp, clock_type=kind)

    def all_frames_as_yaml(self) -> str:
        """Return what is stored of every edge, as tf2 writes it."""
        return report.as_yaml(self.edges())

    def all_frames_as_string(self) -> str:
        """Return every frame and its parent, a line each, as tf2 writes it."""
        return report.as_string(self.edges())
