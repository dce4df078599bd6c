# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2's C++ buffer through its Python binding, as ROS 1 and ROS 2 both have it.

Uses the standard library only, because Debian's runs in another Python. The caller provides the
binding, the messages and the times.
"""

from collections.abc import Sequence
from typing import Any

from ..motion import Robot

_AUTHORITY = 'benchmark'


class CppBuffer:
    """
    ``tf2_py.BufferCore``.

    Looks up with ``lookup_transform_core``. tf2's Python code also calls ``can_transform`` before
    each lookup, which costs more.
    """

    def __init__(self, binding: Any) -> None:
        """
        Store the binding.

        :param binding: the module ``tf2_py``.
        """
        self._binding = binding

    def duration(self, seconds: float) -> Any:
        """Return a duration in the form that the binding accepts."""
        raise NotImplementedError

    def reset(self, robot: Robot, history_s: float) -> None:
        """Start again with an empty buffer."""
        self.buffer = self._binding.BufferCore(self.duration(history_s))
        self.lookup = self.buffer.lookup_transform_core
        self._frames = [edge.child for edge in robot.edges]

    def insert(self, message: Any) -> None:
        """Insert a moving transform."""
        self.buffer.set_transform(message, _AUTHORITY)

    def insert_static(self, message: Any) -> None:
        """Insert a static transform."""
        self.buffer.set_transform_static(message, _AUTHORITY)

    def can(self, target: str, source: str, time: Any) -> bool:
        """Return whether a lookup would succeed."""
        return bool(self.buffer.can_transform_core(target, source, time)[0])

    def lookup_tree(self, target: str, time: Any) -> dict[str, Any]:
        """Return the poses of all frames relative to one; tf2 needs one lookup per frame."""
        lookup = self.lookup
        return {frame: lookup(target, frame, time) for frame in self._frames}

    def pose(self, answer: Any) -> Sequence[float]:
        """Return the seven numbers of a message."""
        t, q = answer.transform.translation, answer.transform.rotation
        return t.x, t.y, t.z, q.x, q.y, q.z, q.w
