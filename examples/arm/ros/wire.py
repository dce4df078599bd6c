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
