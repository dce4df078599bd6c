# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The size of a robot, of its axes, and of the cells of the ground."""

from typing import Final

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from .camera import Camera
from ..model.moment import Moment

# Shorter edges do not count, metres.
_TOGETHER: Final = 1e-3
_LEAST: Final = 0.1
# Frames beyond a gap of so many times the robot's size are not part of the robot.
_GAP: Final = 3.0
# The shortest and the longest axes on the screen, CSS pixels.
_SHORTEST, _LONGEST = 14.0, 42.0
_CELLS_ACROSS: Final = 12.0


def axes_length(moment: Moment) -> float:
    """Return half of the median length of the edges, metres, which a far map does not affect."""
    places = np.flatnonzero(moment.parents >= 0)
    lengths = np.linalg.norm(
        moment.poses[places, :3] - moment.poses[moment.parents[places], :3], axis=1)
    lengths = lengths[lengths > _TOGETHER]
    return float(f'{np.median(lengths) / 2.0:.1g}') if len(lengths) else _LEAST


def lengths_on_screen(camera: Camera | None, positions: Array, length: float) -> Array:
    """
    Return the length of each frame's axes, (N,) metres, limited on the screen.

    :param camera: None: not known yet, so all axes get the same length.
    :param positions: (N, 3) in the page's axes, metres.
    :param length: the length where the limits allow it, metres.
    """
    lengths = np.full(len(positions), length)
    if camera is None:
        return lengths
    pixel = camera.metres_per_pixel(np.maximum(camera.project(positions)[1], 1e-6))
    clipped: Array = np.clip(lengths, _SHORTEST * pixel, _LONGEST * pixel)
    return clipped


def of_the_robot(positions: Array) -> npt.NDArray[np.bool_]:
    """
    Return which frames belong to the robot and are not far from it, as a map's origin is, (N,).

    :param positions: (N, 3) metres.
    """
    distances = np.linalg.norm(positions - np.median(positions, axis=0), axis=1)
    order = np.sort(distances)
    core = max(float(order[len(order) // 2]), _LEAST)
    beyond = order[order > core]
    gaps = np.concatenate([[core], beyond])
    wide = np.flatnonzero(gaps[1:] > _GAP * gaps[:-1])
    return distances <= (gaps[wide[0]] if len(wide) else np.inf)


def cell_of(reach: float) -> float:
    """Return the length of a cell of the ground: 1, 2 or 5 times a power of ten, metres."""
    wanted = max(reach, 1e-3) * 2.0 / _CELLS_ACROSS
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * next(step for step in (1.0, 2.0, 5.0, 10.0) if step * power >= wanted))
