# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples of one edge."""

import numpy as np

from ..edges.protocol import History, moves
from ..geometry.pose import Pose
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
