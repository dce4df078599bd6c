# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An RGB-D image, and the pinhole camera that took it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Intrinsics(NamedTuple):
    """
    A pinhole camera without distortion, with square pixels; all in pixels.

    Its frame is ROS' optical frame: x to the right of the image, y down, z ahead.
    """

    width: int
    height: int
    focal: float
    center: tuple[float, float]
    """Column and row at which the optical axis meets the image; (0, 0) is the first pixel."""


class Image(NamedTuple):
    """
    One image of the camera.

    :ivar stamp: nanoseconds.
    :ivar color: (height, width, 3) uint8, red green blue.
    :ivar depth: (height, width) metres along the optical axis.
    """

    stamp: int
    color: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float64]
    intrinsics: Intrinsics


def back_project(image: Image) -> npt.NDArray[np.float64]:
    """Return the point of each pixel (height, width, 3), in the camera's frame."""
    return _rays(image.intrinsics) * image.depth[..., None]


@lru_cache
def _rays(intrinsics: Intrinsics) -> npt.NDArray[np.float64]:
    """Return the point of each pixel at a depth of one metre."""
    cx, cy = intrinsics.center
    v, u = np.mgrid[:intrinsics.height, :intrinsics.width]
    return np.stack([(u - cx) / intrinsics.focal, (v - cy) / intrinsics.focal,
                     np.ones(u.shape)], axis=-1)


def project(points: npt.ArrayLike, intrinsics: Intrinsics) -> npt.NDArray[np.float64]:
    """Return the pixels (N, 2), column and row, of points (N, 3) in the camera's frame."""
    p = np.asarray(points, dtype=float)
    return intrinsics.focal * p[:, :2] / p[:, 2:] + intrinsics.center
