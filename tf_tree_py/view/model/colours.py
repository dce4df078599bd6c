# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The colours of frames on the page: static, moving, stale, chosen."""

from typing import Final

import numpy as np
import numpy.typing as npt

from .moment import Moment

Colours = npt.NDArray[np.uint8]

STATIC: Final = (70, 120, 210)
MOVING: Final = (235, 130, 20)
CHOSEN: Final = (220, 30, 140)

# A stale frame is dark grey at first, and light grey after so many nanoseconds.
_DARK, _LIGHT = 90.0, 190.0
_FADED = 30_000_000_000


def greys(ages: npt.NDArray[np.int64]) -> Colours:
    """Return the grey of stale frames by their ages, (N, 3)."""
    faded = np.clip(ages / _FADED, 0.0, 1.0)
    return np.repeat((_DARK + faded * (_LIGHT - _DARK)).astype(np.uint8)[:, None], 3, axis=1)


def of_edges(moment: Moment) -> Colours:
    """Return the colour of the line from each frame to its parent, (N, 3)."""
    colours: Colours = np.array([MOVING, STATIC], np.uint8)[moment.static.astype(int)]
    colours[moment.stale] = greys(moment.ages[moment.stale])
    return colours
