"""Where a frame has been."""

import numpy as np
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.tree.queries import Queries

# More points than this are no smoother on a screen.
_MOST = 400


def trail(tree: Queries, fixed_frame: str, frame: str, begin: int, end: int) -> Array:
    """
    Return where a frame was in the fixed one, from one stamp to another.

    :return: (N, 2, 3) metres, a piece of the way each; a gap where there was no data.
    """
    stamps = np.linspace(begin, end, _MOST).round().astype(np.int64)
    try:
        poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    except TransformException:
        return np.empty((0, 2, 3))
    pieces = np.stack([poses[:-1, :3], poses[1:, :3]], axis=1)
    return pieces[valid[:-1] & valid[1:]]
