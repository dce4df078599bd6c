# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The path that a frame has taken, as a line to draw."""

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry.so3 import Array

# The number of points, which is enough for a smooth line on a screen.
_MOST = 400


def trail(tree: AllQueries, fixed_frame: str, frame: str, begin: int, end: int) -> Array:
    """
    Return the path of a frame in the fixed frame between two stamps.

    :return: (N, 2, 3) line segments, metres, with gaps where there are no data.
    """
    stamps = np.linspace(begin, end, _MOST).round().astype(np.int64)
    try:
        poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    except TransformException:
        return np.empty((0, 2, 3))
    pieces = np.stack([poses[:-1, :3], poses[1:, :3]], axis=1)
    return pieces[valid[:-1] & valid[1:]]
