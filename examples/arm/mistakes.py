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

"""Three ways to break it; each changes one line of what is right."""

from collections.abc import Callable
from typing import NamedTuple

from tf_tree_py.core import BufferCore, Pose

from .image import Image
from .pick_and_place import locate

Locate = Callable[[BufferCore, Image, Pose], Pose]


def locate_at_latest(tree: BufferCore, image: Image, camera_T_block: Pose) -> Pose:
    """Take where the camera is by now for where it was."""
    return tree.lookup('world', 'camera') @ camera_T_block


def locate_swapped(tree: BufferCore, image: Image, camera_T_block: Pose) -> Pose:
    """Look up the way from the world to the camera, and use it for the way back."""
    return tree.lookup('camera', 'world', image.stamp) @ camera_T_block


def freeze_camera(tree: BufferCore) -> None:
    """Tell once where the camera is in the world, as if it stood on a tripod."""
    tree.insert('world', 'camera', 0, tree.lookup('world', 'camera'), static=True)


def leave(tree: BufferCore) -> None:
    """Leave the tree as it is."""


class Way(NamedTuple):
    """
    One way to do it.

    :ivar summary: what is done, in a few words.
    :ivar prepare: what is done to the tree before the arm moves.
    :ivar locate: how the detection gets into the world.
    """

    summary: str
    prepare: Callable[[BufferCore], None] = leave
    locate: Locate = locate


RIGHT = Way("the tree, asked for the image's stamp")
MISTAKES = {
    'latest': Way('the tree, asked for the latest', locate=locate_at_latest),
    'frozen': Way("a camera's edge that is not updated while the arm moves",
                  prepare=freeze_camera),
    'swapped': Way('a lookup with its arguments swapped', locate=locate_swapped),
}
WAYS = {'right': RIGHT, **MISTAKES}
