"""Queries by ROS times: the base of ``Buffer`` and of its snapshots."""

from typing import Any

from rclpy.time import Time
from tf_tree_py.core.times import checked_stamp
from tf_tree_py.core.tree.queries import Queries, Snapshot
from tf_tree_py.core.tree.tree import Tree

from .convert import as_stamp


class RosTimes(Queries):
    """Queries that take a ``Time`` of rclpy or of a message as a stamp too."""

    def _is_simulated(self) -> bool:
        """Return whether stamps are of another clock than the system's."""
        return False

    def _as_stamp(self, time: Any) -> int:
        return as_stamp(time, self._is_simulated)

    def _stamp_of(self, stamp: Any) -> int:
        if isinstance(stamp, Time) or hasattr(stamp, 'nanosec'):
            return self._as_stamp(stamp)
        return checked_stamp(stamp)

    def snapshot(self) -> Snapshot:
        """Return a copy of everything as it is now, for several lookups that must agree."""
        with self._lock:
            return RosSnapshot(self._tree.copy(), self._is_simulated())


class RosSnapshot(RosTimes, Snapshot):
    """A buffer's contents at one moment, asked by ROS times."""

    def __init__(self, tree: Tree, simulated: bool) -> None:
        """
        Take a tree that nobody changes any more.

        :param simulated: whether time was simulated then.
        """
        super().__init__(tree)
        self._simulated = simulated

    def _is_simulated(self) -> bool:
        return self._simulated
