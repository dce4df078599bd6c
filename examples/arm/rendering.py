# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Images by PyBullet's software renderer, which needs no window and no graphics card."""

from typing import Any

import numpy as np
import pybullet
from tf_tree_py.core import Pose

from .image import Image, Intrinsics
from .simulator import Simulator

# The middle is offset by half a pixel: this renderer samples a pixel at its lower left corner.
INTRINSICS = Intrinsics(320, 240, 208.0, (160.0, 119.0))

_NEAR, _FAR = 0.02, 3.0


def render(bullet: Simulator, world_T_camera: Pose, intrinsics: Intrinsics, stamp: int) -> Image:
    """Return the image of a camera at a pose; its frame is the optical one."""
    _, _, rgba, buffer, _ = bullet.getCameraImage(
        intrinsics.width, intrinsics.height, _view(world_T_camera), _projection(intrinsics),
        lightDirection=(1.0, 1.0, 3.0), shadow=0, renderer=pybullet.ER_TINY_RENDERER,
        flags=pybullet.ER_NO_SEGMENTATION_MASK)
    depth = _FAR * _NEAR / (_FAR - (_FAR - _NEAR) * np.asarray(buffer, dtype=float))
    color = np.asarray(rgba, dtype=np.uint8)[..., :3]
    return Image(stamp, color, depth, intrinsics)


def _view(world_T_camera: Pose) -> Any:
    """Return OpenGL's view matrix: an OpenGL camera looks along -z, and y is up."""
    ahead, down = world_T_camera @ ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    eye = np.array(world_T_camera.translation)
    return pybullet.computeViewMatrix(eye.tolist(), ahead.tolist(), (eye - down).tolist())


def _projection(intrinsics: Intrinsics) -> Any:
    height_at_one_metre = intrinsics.height / intrinsics.focal
    return pybullet.computeProjectionMatrixFOV(
        2.0 * np.degrees(np.arctan(height_at_one_metre / 2.0)),
        intrinsics.width / intrinsics.height, _NEAR, _FAR)
