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

"""What a colour on the page means: static, moving, stale by how long, chosen."""

from typing import Final

import numpy as np
import numpy.typing as npt

from .moment import Moment

Colours = npt.NDArray[np.uint8]

STATIC: Final = (70, 120, 210)
MOVING: Final = (235, 130, 20)
CHOSEN: Final = (220, 30, 140)

# A stale frame begins as dark grey, and is light grey after so many nanoseconds.
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
