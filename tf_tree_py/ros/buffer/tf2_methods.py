"""The methods of ``tf2_py.BufferCore`` under their own names, in messages and ROS times."""

from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.clock_type import ClockType
from rclpy.time import Time
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.errors import InvalidArgumentException, TransformException
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.telling import report

from ..messages.convert import transform_stamped
from ..messages.times import RosTimes


class CoreApi(RosTimes, BufferCore):
    """What tf2_py offers: lookups that never wait, and listings."""

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
