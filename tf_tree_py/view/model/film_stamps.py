# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The moments that make up a film of a page."""

from typing import Final

import numpy as np
from tf_tree_py.core.times import Stamps

RATE_HZ: Final = 10.0
MOST_FRAMES: Final = 300


def film_stamps(window: tuple[int, int], stamp: int, seconds: float, speed: float) -> Stamps:
    """
    Return the stamps of the frames of a film, nanoseconds.

    The film begins at the moment that the page shows. It begins earlier if less than its length
    is left before the end of the window, so that a live page shows the last seconds.

    :param window: the oldest and the newest stamp that the page can show, nanoseconds.
    :param stamp: of the moment that the page shows, nanoseconds.
    :param seconds: length of the film in recorded time.
    :param speed: recorded seconds per second of the film.
    """
    oldest, latest = window
    length = min(round(seconds * 1e9), latest - oldest)
    begin = max(oldest, min(stamp, latest - length))
    count = round(length * 1e-9 / speed * RATE_HZ) + 1
    return np.linspace(begin, begin + length, min(max(count, 1), MOST_FRAMES)).astype(np.int64)
