# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Deskewing: the points of a scan, moved to one time.

A spinning lidar takes a tenth of a second for a scan. On a moving robot, it measures each
point from a different pose. ``deskew`` moves all points to one time, through a frame that does
not move meanwhile: it applies ``lookup_full`` to every point.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.times import Stamp, StampsLike
from tf_tree_py.many_stamps import ManyStampQueries


def deskew(tree: ManyStampQueries, points: npt.ArrayLike, stamps: StampsLike, target_frame: str,
           source_frame: str, reference_stamp: Stamp, fixed_frame: str = 'odom') -> Any:
    """
    Return the coordinates of points in the target frame, all at one time.

    target_p = (target <- fixed at reference_stamp) (fixed <- source at stamp) source_p.
    To leave a scan in its own frame, pass that frame as target and as source.

    :param tree: a buffer or a snapshot.
    :param points: (N, 3) metres, each in the source frame at its own stamp.
    :param stamps: (N,) integer nanoseconds, when each point was taken.
    :param reference_stamp: nanoseconds; ``LATEST`` for the newest possible.
    :param fixed_frame: a frame that does not move or jump meanwhile; by REP 105 that is
        odom, not map.
    :return: (N, 3) metres, of the points' own floating type. NaN stays NaN.
    :raises InvalidArgumentException: mismatched shapes, or stamps that are not integers.
    :raises TransformException: as in ``lookup_many``; the buffer must cover the whole scan.
    """
    array = np.asarray(points)
    count = np.asarray(stamps).shape
    if array.ndim != 2 or array.shape[1] != 3 or count != array.shape[:1]:
        raise InvalidArgumentException(
            f'points must be (N, 3) with stamps (N,), not {array.shape} and {count}')
    still = tree.snapshot()
    target_T_fixed = still.lookup(target_frame, fixed_frame, reference_stamp)
    fixed_T_source = still.lookup_many(fixed_frame, source_frame, stamps)
    moved = target_T_fixed @ (fixed_T_source @ array)
    dtype = array.dtype if array.dtype.kind == 'f' else np.dtype(float)
    return moved.astype(dtype, copy=False)
