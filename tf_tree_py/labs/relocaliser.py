# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Estimating the pose of a camera from its picture of a scene of splats.

It uses photometric Gauss-Newton from a prior.

The residual is the difference of two pictures, blurred less and less; its Jacobian is
numeric. The covariance is that of least squares: the inverse of J^T J times the variance
of the residual.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

from .splats import picture, Scene

# Pixels of blur, and steps at each.
_BLURS, _STEPS = (3.0, 1.0, 0.0), 4
# The step of the numeric Jacobian, metres and radians.
_ASIDE = 1e-4
# A smaller step ends the iteration.
_SMALL = 2e-4


class Fit(NamedTuple):
    """
    The estimated pose of a picture.

    :ivar covariance: (6, 6), as in ``PoseWithCovariance``.
    :ivar residual: the root mean square of the residual, in grey values from 0 to 1.
    """

    map_T_camera: PoseTuple
    covariance: Array
    residual: float


def relocalise(scene: Scene, seen: Array, prior: PoseTuple) -> Fit:
    """
    Return the pose from which a picture was taken.

    :param seen: (HEIGHT, WIDTH, 3).
    :param prior: ``map_T_camera``, with an error of some centimetres and degrees.
    """
    pose = prior
    for blur in _BLURS:
        for _ in range(_STEPS):
            residual, jacobian = _linearised(scene, seen, pose, blur)
            step = np.linalg.solve(jacobian.T @ jacobian, -jacobian.T @ residual)
            pose = moved(pose, step)
            if np.abs(step).max() < _SMALL:
                break
    residual, jacobian = _linearised(scene, seen, pose, 0.0)
    variance = float(residual @ residual) / (len(residual) - 6)
    return Fit(pose, np.linalg.inv(jacobian.T @ jacobian) * variance, variance**0.5)


def _linearised(scene: Scene, seen: Array, pose: PoseTuple, blur: float) -> tuple[Array, Array]:
    """Return the residual (N,) and its Jacobian (N, 6)."""
    here = picture(scene, pose)
    aside = [picture(scene, moved(pose, step)) - here for step in _ASIDE * np.eye(6)]
    residual, *columns = (_blurred(one, blur) for one in (here - seen, *aside))
    return residual, np.stack(columns, axis=1) / _ASIDE


def _blurred(difference: Array, blur: float) -> Array:
    if blur:
        difference = gaussian_filter(difference, (blur, blur, 0.0))
    return difference.ravel()


def moved(pose: PoseTuple, step: Array) -> PoseTuple:
    """Return a pose after a small motion: in the map's axes, about its own origin."""
    x, y, z, *vector = step.tolist()
    turn = so3.exp((vector[0], vector[1], vector[2]))
    return (pose[0] + x, pose[1] + y, pose[2] + z, *so3.multiply(turn, pose[3:]))
