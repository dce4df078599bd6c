# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The extent of a robot: its frames and the corners of its links."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry.so3 import Array

from .shapes import LinkShape
from ..model.moment import Moment


def corners_of(shapes: Sequence[LinkShape]) -> dict[str, Array]:
    """Return the corners of the box around each link's shapes, (8, 3) in its frame."""
    spans: dict[str, tuple[Array, Array]] = {}
    for shape in shapes:
        if not len(shape.vertices):
            continue
        low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        least, most = spans.get(shape.link, (low, high))
        spans[shape.link] = np.minimum(low, least), np.maximum(high, most)
    unit = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    return {link: low + unit * (high - low) for link, (low, high) in spans.items()}


def extent(moment: Moment, shown: npt.NDArray[np.bool_], corners: dict[str, Array]) -> Array:
    """
    Return points whose convex hull contains some frames and their links.

    :param shown: (N,) whether each frame counts.
    :param corners: the corners of each link, (8, 3) in its frame, by frame.
    :return: (M, 3) in the fixed frame, metres.
    """
    points = [moment.poses[shown, :3]]
    for place in np.flatnonzero(shown).tolist():
        box = corners.get(moment.frames[place])
        if box is not None:
            points.append(np.asarray(Pose(*moment.poses[place].tolist()) @ box))
    return np.concatenate(points)
