# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Perception: the pose of the top of the red block in an RGB-D image.

It uses one image and the camera's intrinsics. It does not use the pose of the camera, so all
poses and points are in the camera's frame.
"""

import numpy as np
import numpy.typing as npt
from tf_tree_py.core import Pose

from .image import back_project, Image
from .scene import BLOCK_SIZE

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_FEWEST_PIXELS = 100
_CANDIDATES = 500
_SAME_DIRECTION = np.cos(np.radians(10.0))
_FLATNESS = 0.002
_SIZE_TOLERANCE = 0.008


def find_block(image: Image) -> Pose | None:
    """
    Return camera_T_block: the middle of the block's top, z pointing out of it, x along its length.

    :return: None unless the whole top is visible.
    """
    red = segment(image.color)
    if red.sum() < _FEWEST_PIXELS or _touches_border(red):
        return None
    points = back_project(image)
    normals, seen = _normals(points, red)
    if not len(seen):
        return None
    top = _largest_face(normals, seen, points[red])
    return _rectangle(top)


def segment(color: npt.NDArray[np.uint8]) -> Mask:
    """Return the mask of red pixels. It uses ratios, so it works in bright light and in shadow."""
    red, green, blue = np.moveaxis(color[..., :3].astype(float), -1, 0)
    return (red > 60.0) & (red > 2.5 * green) & (red > 2.5 * blue)


def _touches_border(mask: Mask) -> bool:
    return bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())


def _normals(points: Array, mask: Mask) -> tuple[Array, Array]:
    """Return the unit normals of the pixels whose four neighbours are in the mask, and points."""
    across, down = points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1]
    inner = (mask[1:-1, 1:-1] & mask[1:-1, 2:] & mask[1:-1, :-2] & mask[2:, 1:-1]
             & mask[:-2, 1:-1])
    # The cross product of down and across points to the camera, because x is right and y is down.
    normals = np.cross(down[inner], across[inner])
    return (normals / np.linalg.norm(normals, axis=1, keepdims=True), points[1:-1, 1:-1][inner])


def _largest_face(normals: Array, seen: Array, points: Array) -> Array:
    """Return the points on the face with whose normal most pixels agree."""
    some = normals[::1 + len(normals) // _CANDIDATES]
    agree = normals @ some.T > _SAME_DIRECTION
    face = agree[:, agree.sum(axis=0).argmax()]
    normal, middle = normals[face].mean(axis=0), seen[face].mean(axis=0)
    return points[abs((points - middle) @ normal) < _FLATNESS]


def _rectangle(points: Array) -> Pose | None:
    """Return the pose of the smallest rectangle around points, if it has the size of the top."""
    # The rows: two directions in the plane of the points, and its normal.
    plane = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    flat = points @ plane[:2].T
    angles = np.radians(np.arange(0.0, 180.0, 0.5))
    x_axes = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    y_axes = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    lengths, widths = (np.ptp(flat @ axes.T, axis=0) for axes in (x_axes, y_axes))
    best = np.where(lengths >= widths, lengths * widths, np.inf).argmin()
    if abs(np.array([lengths[best], widths[best]]) - BLOCK_SIZE[:2]).max() > _SIZE_TOLERANCE:
        return None
    turn = np.stack([x_axes[best], y_axes[best]])
    x, y = (np.max(flat @ turn.T, axis=0) + np.min(flat @ turn.T, axis=0)) / 2
    x_axis, y_axis = turn @ plane[:2]
    z_axis = np.cross(x_axis, y_axis)
    middle = x * x_axis + y * y_axis + (points @ z_axis).mean() * z_axis
    if z_axis @ middle > 0:  # the top faces the camera
        y_axis, z_axis = -y_axis, -z_axis
    pose = np.eye(4)
    pose[:3] = np.stack([x_axis, y_axis, z_axis, middle], axis=1)
    return Pose.from_matrix(pose)
