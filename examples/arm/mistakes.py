# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Three mistakes, each of which changes one line of the correct program."""

from collections.abc import Callable
from typing import NamedTuple

from tf_tree_py import BufferCore
from tf_tree_py.core import Pose

from .image import Image
from .pick_and_place import locate

Locate = Callable[[BufferCore, Image, Pose], Pose]


def locate_at_latest(tree: BufferCore, image: Image, camera_T_block: Pose) -> Pose:
    """Use the current pose of the camera instead of that at the image's stamp."""
    return tree.lookup('world', 'camera') @ camera_T_block


def locate_swapped(tree: BufferCore, image: Image, camera_T_block: Pose) -> Pose:
    """Look up the inverse transform, and use it as if it were the right one."""
    return tree.lookup('camera', 'world', image.stamp) @ camera_T_block


def freeze_camera(tree: BufferCore) -> None:
    """Insert the pose of the camera in the world once, as if it stood on a tripod."""
    tree.insert('world', 'camera', 0, tree.lookup('world', 'camera'), static=True)


def leave(tree: BufferCore) -> None:
    """Leave the tree unchanged."""


class Way(NamedTuple):
    """
    One way to locate the block.

    :ivar summary: a short description.
    :ivar prepare: changes the tree before the arm moves.
    :ivar locate: transforms the detection to the world.
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
