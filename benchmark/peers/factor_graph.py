# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""GTSAM from Python: the covariance of a chain of poses, as a factor graph and its marginals."""

from collections.abc import Sequence

import gtsam
import numpy as np
import numpy.typing as npt
from tf_tree_py.core import Pose, se3

Array = npt.NDArray[np.float64]

# So small that the root counts as fixed.
_OF_ROOT = 1e-7


class FactorGraph:
    """Computes the covariance of a chain like ``lookup_uncertain``, from poses and covariances."""

    def __init__(self, covariance: Array) -> None:
        """
        Store the covariance (6, 6) of every edge, in our order: x y z, rotation.

        It is diagonal and the same in any axes. GTSAM has the rotation first, in the child's axes.
        """
        turned = covariance[np.ix_([3, 4, 5, 0, 1, 2], [3, 4, 5, 0, 1, 2])]
        self._noise = gtsam.noiseModel.Gaussian.Covariance(turned)
        self._prior = gtsam.noiseModel.Isotropic.Sigma(6, _OF_ROOT)

    def covariance(self, edges: Sequence[Pose]) -> tuple[object, Array]:
        """Return the pose of the last frame in the first, and its covariance, (6, 6)."""
        graph, values, reached = gtsam.NonlinearFactorGraph(), gtsam.Values(), gtsam.Pose3()
        graph.add(gtsam.PriorFactorPose3(0, reached, self._prior))
        values.insert(0, reached)
        for number, pose in enumerate(edges):
            edge = gtsam.Pose3(se3.as_matrix(pose))
            reached = reached.compose(edge)
            graph.add(gtsam.BetweenFactorPose3(number, number + 1, edge, self._noise))
            values.insert(number + 1, reached)
        return reached, gtsam.Marginals(graph, values).marginalCovariance(len(edges))
