# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages between the arm's process and its node, through a pipe."""

from typing import NamedTuple

import numpy as np
from tf_tree_py.core import Pose

from ..image import Image, Intrinsics


class Hello(NamedTuple):
    """The first message: the description of the arm."""

    urdf: str
    intrinsics: Intrinsics


class State(NamedTuple):
    """The positions of the joints at each step; nanoseconds, radians and metres."""

    stamp: int
    positions: dict[str, float]


class Picture(NamedTuple):
    """An image as bytes, because numpy's versions may differ: uint8, and float32 metres."""

    stamp: int
    color: bytes
    depth: bytes

    @classmethod
    def of(cls, image: Image) -> 'Picture':
        """Return the message of an image."""
        return cls(image.stamp, image.color.tobytes(), image.depth.astype(np.float32).tobytes())


class Grasp(NamedTuple):
    """A message to the arm: the pose of the block in the world, from the image with that stamp."""

    stamp: int
    world_T_block: Pose
