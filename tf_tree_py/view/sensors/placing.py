# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Transforms readings to the fixed frame, each point at the stamp at which it was measured."""

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST

from .readings import Reading


def placed(tree: AllQueries, fixed_frame: str, reading: Reading, at_newest: bool = False
           ) -> Array | None:
    """
    Return the points of a reading in the fixed frame, (N, 3) metres.

    :param at_newest: use the newest transform instead of the one at the stamp. Many programs
        make this mistake, and a page can show its effect.
    :return: None: there is no transform. Points without a transform at their own stamp are
        left out.
    """
    frame = reading.frame.removeprefix('/')
    try:
        if at_newest or reading.stamps is None:
            pose = tree.lookup(fixed_frame, frame, LATEST if at_newest else reading.stamp)
            return np.asarray(pose @ reading.points)
        return _deskewed(tree, fixed_frame, frame, reading)
    except TransformException:
        return None


def _deskewed(tree: AllQueries, fixed_frame: str, frame: str, reading: Reading) -> Array:
    """Return the points that have a transform at their own stamps."""
    assert reading.stamps is not None
    # Many points of a cloud share a stamp, and each stamp is looked up once.
    stamps, places = np.unique(reading.stamps, return_inverse=True)
    poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    poses, measured = poses[places], valid[places]
    points: Array = so3.rotate_many(poses[:, 3:], reading.points) + poses[:, :3]
    return points[measured]
