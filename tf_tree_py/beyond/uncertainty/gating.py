# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Whether two uncertain poses agree; and the conversion of covariances to and from GTSAM.

Errors follow the convention of ``covariances``: the translation in the parent's axes, the
rotation about the parent's axes through the child's origin.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

from .covariances import checked_covariance


class Agreement(NamedTuple):
    """
    The agreement of two poses.

    :ivar squared_distance: the squared Mahalanobis distance; its mean for correct poses is the
        number of degrees of freedom.
    :ivar probability: the probability that two correct poses are at least as far apart, 0 to 1:
        a gate that refuses below 0.001 refuses one of a thousand correct poses.
    """

    squared_distance: float
    probability: float


def agreement(pose: PoseTuple, covariance: npt.ArrayLike, other: PoseTuple,
              other_covariance: npt.ArrayLike) -> Agreement:
    """
    Return the agreement of two poses of one frame in another, with independent errors.

    In directions in which both are certain they must be equal, to 1e-9.

    :param covariance: (6, 6) of the pose; ``other_covariance``: of the other.
    :raises InvalidArgumentException: an invalid covariance.
    """
    spread = checked_covariance(covariance) + checked_covariance(other_covariance)
    turn = so3.multiply(other[3:], so3.conjugate(pose[3:]))
    off = np.array((*np.subtract(other[:3], pose[:3]), *so3.log(turn)))
    values, vectors = np.linalg.eigh(spread)
    known = values > 1e-12 * max(float(values[-1]), 1e-12)
    along = vectors.T @ off
    if np.abs(along[~known]).max(initial=0.0) > 1e-9:
        return Agreement(np.inf, 0.0)
    squared = float((along[known]**2 / values[known]).sum())
    # As chi2.sf of scipy.stats, whose import takes half a second.
    return Agreement(squared, float(chdtrc(max(int(known.sum()), 1), squared)))


def as_gtsam(pose: PoseTuple, covariance: npt.ArrayLike) -> Array:
    """
    Return the covariance (6, 6) of a ``gtsam.Pose3``'s tangent, for ``Gaussian.Covariance``.

    There the rotation comes first, and errors are in the body frame: T Exp(xi).
    """
    to_body = _to_body(pose)
    return np.asarray(to_body @ checked_covariance(covariance) @ to_body.T)


def from_gtsam(pose: PoseTuple, covariance: npt.ArrayLike) -> Array:
    """Return GTSAM's covariance (6, 6), such as that of ``Marginals``, in this convention."""
    to_body = _to_body(pose)
    return np.asarray(to_body.T @ checked_covariance(covariance) @ to_body)


def _to_body(pose: PoseTuple) -> Array:
    """Return the orthogonal matrix from an error in this convention to GTSAM's tangent."""
    turn = np.array(so3.as_matrix(so3.conjugate(pose[3:])))
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = matrix[3:, :3] = turn
    return matrix
