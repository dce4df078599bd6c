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

"""
Points that were taken over time, moved to one time.

A spinning lidar takes a tenth of a second for a scan. On a robot that moves, it sees
each point from another place. ``deskew`` moves all points to one time, through a frame
that does not move meanwhile: that is ``lookup_full`` for every point.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentException
from .geometry import se3
from .tree.queries import Queries


def deskew(tree: Queries, points: npt.ArrayLike, stamps: npt.ArrayLike, target_frame: str,
           source_frame: str, reference_stamp: int, fixed_frame: str = 'odom') -> Any:
    """
    Return the coordinates that points would have in the target, all at one time.

    target_p = (target <- fixed at reference_stamp) (fixed <- source at stamp) source_p.
    To keep a scan in its own frame, pass that frame as target and as source.

    :param tree: a buffer or a snapshot.
    :param points: (N, 3) metres, each in the source frame at its own stamp.
    :param stamps: (N,) integer nanoseconds, when each point was taken.
    :param reference_stamp: nanoseconds; ``LATEST`` for the newest possible.
    :param fixed_frame: a frame that does not move or jump meanwhile; by REP 105 that is
        odom, not map.
    :return: (N, 3) metres, of the points' own floating type. NaN stays NaN.
    :raises InvalidArgumentException: shapes that do not fit, stamps that are no integers.
    :raises TransformException: as ``lookup_many``; the scan must lie inside the buffer.
    """
    array = np.asarray(points)
    count = np.shape(stamps)
    if array.ndim != 2 or array.shape[1] != 3 or count != array.shape[:1]:
        raise InvalidArgumentException(
            f'points are (N, 3) and stamps (N,), one for each, not {array.shape} and {count}')
    frozen = tree.snapshot()
    target_T_fixed = frozen.lookup(target_frame, fixed_frame, reference_stamp)
    fixed_T_source = frozen.lookup_many(fixed_frame, source_frame, stamps)
    moved = se3.apply_many(target_T_fixed, se3.apply_many(fixed_T_source, array))
    kind = array.dtype if array.dtype.kind == 'f' else np.dtype(float)
    return moved.astype(kind, copy=False)
