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
tf2's C++ buffer through its Python binding: what ROS 1's and ROS 2's have in common.

Standard library only, for Debian's runs in another Python; the binding, the
messages and the times come from the caller.
"""

from collections.abc import Sequence
from typing import Any

from ..motion import Robot

_AUTHORITY = 'benchmark'


class CppBuffer:
    """
    ``tf2_py.BufferCore``.

    Asked by ``lookup_transform_core``: tf2's Python asks ``can_transform`` as well
    before each lookup, and costs more.
    """

    def __init__(self, binding: Any) -> None:
        """
        Take the binding.

        :param binding: the module ``tf2_py``.
        """
        self._binding = binding

    def duration(self, seconds: float) -> Any:
        """Return a duration as the binding wants it."""
        raise NotImplementedError

    def reset(self, robot: Robot, history_s: float) -> None:
        """Begin anew."""
        self.buffer = self._binding.BufferCore(self.duration(history_s))
        self.lookup = self.buffer.lookup_transform_core
        self._frames = [edge.child for edge in robot.edges]

    def insert(self, message: Any) -> None:
        """Take a transform that moves."""
        self.buffer.set_transform(message, _AUTHORITY)

    def insert_static(self, message: Any) -> None:
        """Take one that does not."""
        self.buffer.set_transform_static(message, _AUTHORITY)

    def can(self, target: str, source: str, time: Any) -> bool:
        """Return whether a lookup would succeed."""
        return bool(self.buffer.can_transform_core(target, source, time)[0])

    def lookup_tree(self, target: str, time: Any) -> dict[str, Any]:
        """Return all frames relative to one; tf2 can only be asked for one at a time."""
        lookup = self.lookup
        return {frame: lookup(target, frame, time) for frame in self._frames}

    def pose(self, answer: Any) -> Sequence[float]:
        """Return the seven numbers of a message."""
        t, q = answer.transform.translation, answer.transform.rotation
        return t.x, t.y, t.z, q.x, q.y, q.z, q.w
