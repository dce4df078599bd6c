# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""pytransform3d's ``TemporalTransformManager``: many stamps in numpy, no insertion."""

import numpy as np
import numpy.typing as npt
from pytransform3d.transform_manager import NumpyTimeseriesTransform, TemporalTransformManager

from .. import motion
from ..motion import Robot


class TemporalManager:
    """
    Edges as time series.

    It interpolates along screw motions, so its results between samples differ from tf2's.
    """

    def __init__(self, robot: Robot, stamps: npt.NDArray[np.int64]) -> None:
        """
        Insert all samples at once.

        :param stamps: (n,) at which every edge has a sample.
        """
        self._robot = robot
        self._manager = TemporalTransformManager(check=False)
        for edge in robot.edges:
            poses = np.array([motion.pose_at(edge, stamp) for stamp in stamps.tolist()])
            # Position, then quaternion w x y z.
            poses = poses[:, [0, 1, 2, 6, 3, 4, 5]]
            self._manager.add_transform(
                edge.child, edge.parent, NumpyTimeseriesTransform(stamps, poses))

    def lookup_many(self, stamps: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        """Return (N, 4, 4)."""
        return np.asarray(self._manager.get_transform_at_time(
            self._robot.source, self._robot.target, stamps))
