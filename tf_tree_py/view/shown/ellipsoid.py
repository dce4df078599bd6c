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

"""Where a frame may be, as an ellipsoid around where it is said to be."""

from typing import Final, NamedTuple

import numpy as np
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array, Quaternion
from tf_tree_py.core.tree.queries import Queries

from .moment import Moment

# A frame is inside of it in three of four cases, and along each axis in nineteen of twenty.
_SIGMAS: Final = 2.0
# What is certain along an axis is drawn as a disc, whose surface still has a direction.
_THINNEST: Final = 1e-3


class Ellipsoid(NamedTuple):
    """
    Two standard deviations of a position, as the fixed frame sees it.

    :ivar place: of its frame among those of the moment.
    :ivar rotation: of its own axes, x y z w.
    :ivar semi_axes: (3,) metres.
    """

    place: int
    rotation: Quaternion
    semi_axes: Array


def ellipsoid(tree: Queries, moment: Moment, frame: str) -> Ellipsoid | None:
    """Return the ellipsoid of a frame; None where nothing is known of how far it may be off."""
    place = moment.place(frame)
    if place is None or not tree.has_covariances:
        return None
    try:
        _, covariance = Queries.lookup_uncertain(
            tree, moment.fixed_frame, frame, int(moment.stamps[place]))
    except TransformException:  # what there was a moment ago has expired
        return None
    variances, axes = np.linalg.eigh(covariance[:3, :3])
    if variances[-1] <= 0.0:
        return None
    semi_axes = _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    # Either sign of an eigenvector is one; these make a rotation and no mirror.
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return Ellipsoid(place, so3.from_matrix(axes),
                     np.maximum(semi_axes, _THINNEST * semi_axes[-1]))
