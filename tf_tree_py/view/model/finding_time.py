# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The moment at which a page shows a finding.

The slider marks the stamps of refused and odd samples.
"""

from collections import deque
from collections.abc import Collection, Sequence
import threading
from typing import Final

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import TransformException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.health.checks.finding import Finding

# More marks cannot be distinguished on a slider.
_MOST = 200


class IncidentLog(Observer):
    """Keeps the stamps of the last incidents of a buffer, as one of its observers."""

    def __init__(self) -> None:
        """Begin without incidents."""
        self._lock = threading.Lock()
        self._kept: deque[tuple[int, frozenset[str]]] = deque(maxlen=_MOST)

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Remember incidents."""
        with self._lock:
            self._kept.extend((incident.stamp, frozenset((incident.parent, incident.child)))
                              for incident in incidents if incident.stamp != LATEST)

    def stamps(self, frames: Collection[str] | None = None) -> list[int]:
        """
        Return the stamps of the incidents, nanoseconds, in order.

        :param frames: only those about one of these frames; None: all.
        """
        with self._lock:
            return sorted({stamp for stamp, about in self._kept
                           if frames is None or not about.isdisjoint(frames)})


# --- the time of a finding

# A gap between samples is at least so many times as long as the median.
_WIDE: Final = 3.0


def time_of(finding: Finding, tree: AllQueries, log: IncidentLog) -> int | None:
    """
    Return the stamp of a finding, nanoseconds; None: it has no time.

    This is the stamp of the first incident about its frames. Without incidents, it is the
    beginning of the widest gap between the samples of its last frame. Without gaps, it is the
    sample at which this frame moves most.
    """
    incidents = log.stamps(finding.frames)
    if incidents:
        return incidents[0]
    for frame in reversed(finding.frames):
        stamp = _worst(tree, frame)
        if stamp is not None:
            return stamp
    return None


def _worst(tree: AllQueries, frame: str) -> int | None:
    if frame not in tree.frames():
        return None
    stamps = np.asarray(tree.stamps_of(frame))
    if len(stamps) < 3:
        return int(stamps[0]) if len(stamps) else None
    gaps = np.diff(stamps)
    if gaps.max() > _WIDE * np.median(gaps):
        return int(stamps[int(gaps.argmax())])
    parent = next((edge.parent for edge in tree.edges() if edge.child == frame), None)
    if parent is None:
        return None
    try:
        poses, valid = tree.lookup_many(parent, frame, stamps, outside='mask')
    except TransformException:
        return None
    steps = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1)
    steps[~(valid[1:] & valid[:-1])] = 0.0
    return int(stamps[int(steps.argmax()) + 1])
