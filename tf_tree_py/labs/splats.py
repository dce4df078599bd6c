# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A scene of 3D Gaussians, and pictures of it: a small, complete renderer in numpy.

The Gaussians are projected by the affine approximation of Zwicker et al., "EWA Splatting",
IEEE TVCG 8(3), 2002, and composited front to back as in Kerbl et al., "3D Gaussian Splatting",
ACM TOG 42(4), 2023, without their harmonics, tiles and training.
"""

from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

WIDTH, HEIGHT = 48, 36
_FOCAL = 36.0
_NEAREST = 0.3
# The blur of a pixel, squared pixels; and the background, a grey wall.
_PIXEL = 0.3
_BACKGROUND = 0.4
_MOST_OPAQUE = 0.99


class Scene(NamedTuple):
    """
    Gaussians in the map.

    :ivar means: (G, 3) metres.
    :ivar covariances: (G, 3, 3) square metres.
    :ivar colours: (G, 3), 0 to 1.
    :ivar opacities: (G,), 0 to 1.
    """

    means: Array
    covariances: Array
    colours: Array
    opacities: Array


def room(count: int = 180, seed: int = 5) -> Scene:
    """Return a wall of blobs 3 to 5 m from the origin, to be viewed along x."""
    rng = np.random.default_rng(seed)
    means = np.stack([rng.uniform(2.5, 5.0, count), rng.uniform(-3.5, 3.5, count),
                      rng.uniform(-2.0, 2.0, count)], axis=1)
    turns = so3.as_matrix_many(so3.exp_many(rng.normal(size=(count, 3))))
    sizes = rng.uniform(0.05, 0.35, (count, 1, 3))
    return Scene(means, (turns * sizes**2) @ turns.transpose(0, 2, 1),
                 rng.uniform(0.0, 1.0, (count, 3)), rng.uniform(0.5, 0.95, count))


def picture(scene: Scene, map_T_camera: PoseTuple) -> Array:
    """
    Return the picture of a camera, (HEIGHT, WIDTH, 3).

    :param map_T_camera: x to the right, y down, z forward.
    """
    camera_T_map = se3.inverse(map_T_camera)
    places = se3.apply_many(camera_T_map, scene.means)
    seen = np.flatnonzero(places[:, 2] > _NEAREST)
    seen = seen[np.argsort(places[seen, 2])]
    centres, spreads = _projected(places[seen], np.array(so3.as_matrix(camera_T_map[3:])),
                                  scene.covariances[seen])
    alpha = np.minimum(scene.opacities[seen, None] * _densities(centres, spreads), _MOST_OPAQUE)
    # The transmittance of the nearer Gaussians.
    left = np.cumprod(1.0 - alpha, axis=0)
    weights = alpha * np.concatenate([np.ones((1, alpha.shape[1])), left[:-1]])
    colours = weights.T @ scene.colours[seen] + _BACKGROUND * left[-1][:, None]
    return np.asarray(colours.reshape(HEIGHT, WIDTH, 3))


def _projected(places: Array, turn: Array, covariances: Array) -> tuple[Array, Array]:
    """Return the centres (G, 2) and covariances (G, 2, 2) of Gaussians in the picture."""
    x, y, z = places.T
    zero = np.zeros_like(x)
    jacobian = _FOCAL * np.stack([np.stack([1.0 / z, zero, -x / z**2], axis=-1),
                                  np.stack([zero, 1.0 / z, -y / z**2], axis=-1)], axis=1)
    affine = jacobian @ turn
    spreads = affine @ covariances @ affine.transpose(0, 2, 1) + _PIXEL * np.eye(2)
    centres = _FOCAL * np.stack([x / z, y / z], axis=1) + (WIDTH / 2, HEIGHT / 2)
    return centres, spreads


def _densities(centres: Array, spreads: Array) -> Array:
    """Return each Gaussian, one at its centre, at every pixel: (G, HEIGHT * WIDTH)."""
    a, b, c = spreads[:, 0, 0], spreads[:, 0, 1], spreads[:, 1, 1]
    determinant = a * c - b * b
    du = np.arange(WIDTH) + 0.5 - centres[:, :1]
    dv = np.arange(HEIGHT) + 0.5 - centres[:, 1:]
    across = (c / determinant)[:, None] * du**2
    down = (a / determinant)[:, None] * dv**2
    mixed = (b / determinant)[:, None, None] * dv[:, :, None] * du[:, None, :]
    exponent = -0.5 * (across[:, None, :] + down[:, :, None]) + mixed
    return np.asarray(np.exp(exponent).reshape(len(centres), -1))
