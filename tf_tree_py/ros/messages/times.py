# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""ROS times as the stamps of lookups in a buffer and in its snapshots."""

from collections.abc import Callable
from typing import Any

from rclpy.time import Time
from tf_tree_py.buffer_core import Snapshot
from tf_tree_py.core.times import checked_stamp
from tf_tree_py.core.tree.tree import Tree

from .convert import as_stamp


def checked_ros_stamp(stamp: Any, is_simulated: Callable[[], bool]) -> int:
    """
    Return a caller's stamp: one that the core accepts, or a ``Time`` of rclpy or of a message.

    :param is_simulated: returns whether ROS time differs from the system's.
    :raises InvalidArgumentException: none of these, or a time of another clock.
    """
    if isinstance(stamp, Time) or hasattr(stamp, 'nanosec'):
        return as_stamp(stamp, is_simulated)
    return checked_stamp(stamp)


class RosSnapshot(Snapshot):
    """A buffer's contents at one moment, with lookups by ROS times."""

    def __init__(self, tree: Tree, simulated: bool) -> None:
        """
        Take a tree that does not change any more.

        :param simulated: whether time was simulated then.
        """
        super().__init__(tree)
        self._simulated = simulated

    def _stamp_of(self, stamp: Any) -> int:
        return checked_ros_stamp(stamp, lambda: self._simulated)
