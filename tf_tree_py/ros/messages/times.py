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

"""Stamps as ROS has them, in questions to a buffer and to its snapshots."""

from collections.abc import Callable
from typing import Any

from rclpy.time import Time
from tf_tree_py.core.times import checked_stamp
from tf_tree_py.core.tree.queries import Snapshot
from tf_tree_py.core.tree.tree import Tree

from .convert import as_stamp


def checked_ros_stamp(stamp: Any, is_simulated: Callable[[], bool]) -> int:
    """
    Return a caller's stamp: what the core takes, or a ``Time`` of rclpy or of a message.

    :param is_simulated: tells whether ROS time is another than the system's.
    :raises InvalidArgumentException: none of these, or a time of another clock.
    """
    if isinstance(stamp, Time) or hasattr(stamp, 'nanosec'):
        return as_stamp(stamp, is_simulated)
    return checked_stamp(stamp)


class RosSnapshot(Snapshot):
    """A buffer's contents at one moment, asked by ROS times."""

    def __init__(self, tree: Tree, simulated: bool) -> None:
        """
        Take a tree that nobody changes any more.

        :param simulated: whether time was simulated then.
        """
        super().__init__(tree)
        self._simulated = simulated

    def _stamp_of(self, stamp: Any) -> int:
        return checked_ros_stamp(stamp, lambda: self._simulated)
