# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The animation of docs/pick_and_place.md: one run, from outside and from the wrist."""

from pathlib import Path

import numpy as np
from PIL import Image as Picture
from tf_tree_py.core import from_seconds, Pose

from .cell import Cell
from .image import Intrinsics
from .pictures import reduced
from .trial import run

_FRAME = from_seconds(0.16)
_SHOWN_MS = 120
_COLORS = 48
_LENS = Intrinsics(180, 180, 250.0, (90.0, 89.0))
_WRIST = (240, 180)


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
        cell.watchers.append(lambda: take(cell))

    def take(cell: Cell) -> None:
        if cell.stamp % _FRAME == 0:
            frames.append(reduced(_side_by_side(cell), _COLORS))

    run(0, seed, watch=watch)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=_SHOWN_MS, loop=0,
                   optimize=True)
    return path


def _side_by_side(cell: Cell) -> Picture.Image:
    both = Picture.new('RGB', (_LENS.width + _WRIST[0], _LENS.height))
    outside = cell.take_image_from(_world_T_onlooker(), _LENS)
    both.paste(Picture.fromarray(outside.color), (0, 0))
    both.paste(Picture.fromarray(cell.take_image().color).resize(_WRIST), (_LENS.width, 0))
    return both
