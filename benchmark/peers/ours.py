# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""tf_tree_py itself: the buffer with messages, and its core with plain numbers."""

from collections.abc import Sequence
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from tf_tree_py import Buffer
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.ros.messages.convert import as_nanoseconds, time_message

from .messages import pose_of, transform_stamped
from .. import motion
from ..motion import Robot


class OurBuffer:
    """``Buffer``, as a tf2 user calls it: a full ``TransformStamped`` each time."""

    def reset(self, robot: Robot, history_s: float) -> None:
        """Start again with an empty buffer."""
        self.buffer = Buffer(Duration(seconds=history_s))
        self.insert = self.buffer.set_transform
        self.insert_static = self.buffer.set_transform_static
        self.lookup = self.buffer.lookup_transform

    def message(self, edge: motion.Edge, stamp: int, pose: motion.Pose) -> TransformStamped:
        """Return a transform as a message."""
        return transform_stamped(edge, stamp, pose)

    def time(self, stamp: int) -> Time:
        """Return a time as in the header of a message."""
        return time_message(stamp)

    def lookup_tree(self, target: str, time: Time) -> dict[str, Pose]:
        """Return the poses of all frames relative to one."""
        return self.buffer.lookup_tree(target, as_nanoseconds(time))

    def pose(self, answer: TransformStamped | Pose) -> Sequence[float]:
        """Return the seven numbers of a message, or of a pose of a tree."""
        return answer if isinstance(answer, Pose) else pose_of(answer)


class OurCore:
    """``BufferCore``: without ROS, integer nanoseconds and a ``Pose``."""

    def reset(self, robot: Robot, history_s: float) -> None:
        """Start again with an empty buffer."""
        self.buffer = BufferCore(round(history_s * 1e9))
        self.lookup = self.buffer.lookup
        self.lookup_tree = self.buffer.lookup_tree

    def message(self, edge: motion.Edge, stamp: int, pose: motion.Pose) -> Any:
        """Return the arguments of ``insert``."""
        return edge.parent, edge.child, stamp, pose

    def insert(self, message: Any) -> None:
        """Insert a moving transform."""
        self.buffer.insert(*message)

    def insert_static(self, message: Any) -> None:
        """Insert a static transform."""
        self.buffer.insert(*message, static=True)

    def time(self, stamp: int) -> int:
        """Return the stamp unchanged."""
        return stamp

    def pose(self, answer: Pose) -> Pose:
        """Return the pose unchanged."""
        return answer
