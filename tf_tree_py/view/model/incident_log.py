# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The stamps and frames of samples that were refused or odd, for the marks of the slider."""

from collections import deque
from collections.abc import Collection, Sequence
import threading

from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import LATEST

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
