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

"""pytransform3d's ``TemporalTransformManager``: many stamps in numpy, no insertion."""

import numpy as np
import numpy.typing as npt
from pytransform3d.transform_manager import NumpyTimeseriesTransform, TemporalTransformManager

from .. import motion
from ..motion import Robot


class TemporalManager:
    """
    Edges as time series.

    It interpolates screw motions, so between samples its answers are not tf2's.
    """

    def __init__(self, robot: Robot, stamps: npt.NDArray[np.int64]) -> None:
        """
        Take all samples at once.

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
