# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The animation of docs/pick_and_place.md: one run, from outside and from the wrist.

Below, the position of the block in the camera and in the world, whenever its whole top is visible.
"""

from pathlib import Path

import numpy as np
from PIL import Image as Picture, ImageDraw
from tf_tree_py.core import as_seconds, from_seconds, Pose

from .cell import Cell
from .image import Intrinsics
from .perception import find_block
from .pick_and_place import locate
from .pictures import detection, reduced, write
from .tree import ArmTree
from .trial import run

_FRAME = from_seconds(0.16)
_SHOWN_MS = 120
_COLORS = 48
_LENS = Intrinsics(180, 180, 250.0, (90.0, 89.0))
_WRIST = (240, 180)
_BELOW = 36


def _world_T_onlooker() -> Pose:
    """Return the pose of an observer in front of the cell; an optical frame."""
    eye, at = np.array([1.25, 0.75, 0.85]), np.array([0.25, -0.05, 0.15])
    ahead = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(ahead, right), ahead, eye], axis=1)
    return Pose.from_matrix(matrix)


def film(seed: int, path: Path) -> Path:
    """Write the first run of a seed as an animated GIF; return its path."""
    frames: list[Picture.Image] = []

    def watch(cell: Cell) -> None:
        tree = ArmTree(cell)
        cell.watchers.append(lambda: take(cell, tree))

    def take(cell: Cell, tree: ArmTree) -> None:
        if cell.stamp % _FRAME == 0:
            frames.append(reduced(_side_by_side(cell, tree), _COLORS))

    run(0, seed, watch=watch)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=_SHOWN_MS, loop=0,
                   optimize=True)
    return path


def _side_by_side(cell: Cell, tree: ArmTree) -> Picture.Image:
    both = Picture.new('RGB', (_LENS.width + _WRIST[0], _LENS.height + _BELOW), 'white')
    outside = cell.take_image_from(_world_T_onlooker(), _LENS)
    both.paste(Picture.fromarray(outside.color), (0, 0))
    image = cell.take_image()
    camera_T_block = find_block(image)
    wrist = Picture.fromarray(image.color)
    positions = {'camera': 'not wholly visible', 'world': ''}
    if camera_T_block is not None:
        wrist = detection(image, camera_T_block)
        world_T_block = locate(tree, image, camera_T_block)
        positions = {'camera': _text(camera_T_block), 'world': _text(world_T_block)}
    both.paste(wrist.resize(_WRIST), (_LENS.width, 0))
    pen = ImageDraw.Draw(both)
    write(pen, (4, 3), f'{as_seconds(cell.stamp):.2f} s', 'lt')
    write(pen, (_LENS.width + 4, 3), 'camera on the wrist', 'lt')
    for row, (frame, position) in enumerate(positions.items()):
        y = _LENS.height + 4 + 16 * row
        write(pen, (4, y), f'the block in "{frame}", x y z:', 'lt')
        write(pen, (_LENS.width + 4, y), position, 'lt')
    return both


def _text(pose: Pose) -> str:
    # Adding zero turns -0.0 into 0.0.
    return ',  '.join(f'{round(value, 2) + 0.0:.2f}' for value in pose.translation) + '  m'
