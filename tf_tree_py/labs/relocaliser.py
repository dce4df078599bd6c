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
Where a picture of a scene of splats was taken: photometric Gauss-Newton from a prior.

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
# Metres and radians that the numeric Jacobian looks aside.
_ASIDE = 1e-4
# A step that is smaller than this changes next to nothing.
_SMALL = 2e-4


class Fit(NamedTuple):
    """
    Where a picture was taken.

    :ivar covariance: (6, 6), as ``PoseWithCovariance`` has it.
    :ivar residual: the root mean square of what is left, of grey values from 0 to 1.
    """

    map_T_camera: PoseTuple
    covariance: Array
    residual: float


def relocalise(scene: Scene, seen: Array, prior: PoseTuple) -> Fit:
    """
    Return where a picture was taken.

    :param seen: (HEIGHT, WIDTH, 3).
    :param prior: ``map_T_camera``, some centimetres and degrees off.
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
    """Return a pose moved and turned a little: in the map's axes, about itself."""
    x, y, z, *vector = step.tolist()
    turn = so3.exp((vector[0], vector[1], vector[2]))
    return (pose[0] + x, pose[1] + y, pose[2] + z, *so3.multiply(turn, pose[3:]))
