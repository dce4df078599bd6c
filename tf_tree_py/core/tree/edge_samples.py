# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples of one edge, and its velocity if it is known."""

import numpy as np

from .many_stamps import ends_of
from .tree import Tree
from ..edges.protocol import History, moves
from ..geometry.pose import Pose
from ..geometry.screws import carry_many
from ..geometry.so3 import Array
from ..times import Stamps


def stamps_of(history: History | None) -> Stamps:
    """Return the sorted stamps (N,) of an edge's samples; none for a static edge."""
    if history is None or history.oldest_stamp is None or history.latest_stamp is None:
        return np.empty(0, dtype=np.int64)
    return history.track(history.oldest_stamp, history.latest_stamp).knots


def samples_around(history: History | None, stamp: int) -> list[tuple[int, Pose]]:
    """Return the samples of an edge at or next to a stamp; see ``Queries.samples_around``."""
    if not moves(history) or history.oldest_stamp is None:
        return []
    assert history.latest_stamp is not None
    inside = min(max(stamp, history.oldest_stamp), history.latest_stamp)
    knots = history.track(inside, inside).knots.tolist()
    around = {max((knot for knot in knots if knot <= inside), default=inside),
              min((knot for knot in knots if knot >= inside), default=inside)}
    return [(knot, Pose._make(history.sample(knot))) for knot in sorted(around)]


def twists_between(tree: Tree, near: str, far: str, stamps: Stamps) -> Array | None:
    """
    Return the twist of a frame relative to its neighbour, (N, 6), in its own axes.

    :param stamps: (N,) for which there is data.
    :return: None if the edge between them has only poses.
    """
    for child, parent in (far, near), (near, far):
        history = tree.histories.get(child)
        if history is not None and history.fixed_parent and history.parent == parent:
            break
    else:
        return None
    twists = history.twists(stamps)
    if twists is None or child == far:
        return twists
    # The twist of the inverse is -Ad_A V: Lynch, Park, "Modern Robotics", section 3.3.
    return -carry_many(history.track(*ends_of(stamps)).at(stamps).T, twists)
