"""What goes between the arm's own process and its node, through a pipe."""

from typing import NamedTuple

import numpy as np
from tf_tree_py.core import Pose

from ..image import Image, Intrinsics


class Hello(NamedTuple):
    """The first: what the arm is."""

    urdf: str
    intrinsics: Intrinsics


class State(NamedTuple):
    """At each step: where the joints are; nanoseconds, radians and metres."""

    stamp: int
    positions: dict[str, float]


class Picture(NamedTuple):
    """An image as bytes, for numpy may be another on the other side: uint8, and float32 metres."""

    stamp: int
    color: bytes
    depth: bytes

    @classmethod
    def of(cls, image: Image) -> 'Picture':
        """Return an image's bytes."""
        return cls(image.stamp, image.color.tobytes(), image.depth.astype(np.float32).tobytes())


class Grasp(NamedTuple):
    """To the arm: where the block was seen in an image of that stamp, in the world."""

    stamp: int
    world_T_block: Pose
