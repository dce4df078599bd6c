# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Covariances of six numbers, as pose, twist and accel messages have them.

Row-major (36,): three numbers along the axes x, y, z, then three about them.
"""

from typing import Any

import numpy as np
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import adjoint, PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Quaternion


def rotate_covariance(covariance: Any, a_q_b: Quaternion) -> Array:
    """Return a covariance (36,) in the axes of a: each 3 x 3 block is R C R^T."""
    return _congruent(covariance, _diagonal(a_q_b))


def carry_covariance(covariance: Any, a_T_b: PoseTuple) -> Array:
    """Return the covariance (36,) of a twist that the adjoint transforms from b to a."""
    return _congruent(covariance, adjoint(a_T_b))


def _diagonal(a_q_b: Quaternion) -> Array:
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = so3.as_matrix(a_q_b)
    return matrix


def _congruent(covariance: Any, matrix: Array) -> Array:
    """Return M C M^T of a covariance (36,)."""
    square = np.asarray(covariance, dtype=float).reshape(6, 6)
    return np.asarray(matrix @ square @ matrix.T).reshape(36)
