# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""transform-tree, a transform tree in Rust (imports as ``tf_tree``)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import tf_tree

from .. import motion
from ..exercise import Unable
from ..motion import Robot

_SAMPLES_A_SECOND = 1_000_000_000 // motion.PERIOD


class RustTree:
    """
    A tree whose edges interpolate like tf2's.

    Its plan, which is its path, is made once. Its edges have rings of fixed size, so the length
    of its history is only approximately the requested one.
    """

    def reset(self, robot: Robot, history_s: float) -> None:
        """Start again with an empty tree."""
        if any(edge.static for edge in robot.edges):
            raise Unable('an edge list makes every edge moving')
        capacity = max(2048, 1 << round(history_s * _SAMPLES_A_SECOND).bit_length())
        self._tree = tf_tree.build([(edge.parent, edge.child) for edge in robot.edges],
                                   interp='lerpslerp', capacity=capacity)
        try:
            self._plan = self._tree.plan(robot.target, robot.source)
        except tf_tree.TfTreeError as error:
            raise Unable(str(error)) from error

    def message(self, edge: motion.Edge, stamp: int, pose: motion.Pose) -> Any:
        """Return the arguments of ``push``."""
        x, y, z, qx, qy, qz, qw = pose
        return edge.child, edge.parent, stamp, [qw, qx, qy, qz, x, y, z]

    def insert(self, message: Any) -> None:
        """Insert a transform."""
        tf_tree.push(self._tree, *message)

    def insert_static(self, message: Any) -> None:
        """Not supported."""
        raise NotImplementedError

    def time(self, stamp: int) -> int:
        """Return the stamp unchanged."""
        return stamp

    def lookup(self, target: str, source: str, stamp: int) -> npt.NDArray[np.float64]:
        """Return qw qx qy qz x y z."""
        if not stamp:
            # Its own ``latest`` takes the newest sample of each edge: no pose at any single time.
            stamp = self._tree.span(target, source)[1]
        return self._plan.at(stamp, layout='quat')

    def lookup_many(self, stamps: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        """Return (N, 7) qw qx qy qz x y z."""
        return self._plan.at(stamps, layout='quat')

    def lookup_tree(self, target: str, stamp: Any) -> dict[str, Any]:
        """Not supported."""
        raise NotImplementedError

    def pose(self, answer: npt.NDArray[np.float64]) -> Sequence[float]:
        """Return x y z and the quaternion x y z w."""
        qw, qx, qy, qz, x, y, z = answer.tolist()
        return x, y, z, qx, qy, qz, qw
