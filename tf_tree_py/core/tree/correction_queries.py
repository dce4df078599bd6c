# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Queries about the corrections of edges."""

from .corrections import correction_of, smoothed, Transitions
from .queries import PlainSnapshot, Queries
from .tree import Tree
from ..geometry.pose import Pose


class CorrectionQueries(Queries):
    """The corrections of edges, thread-safe."""

    @property
    def corrections_version(self) -> int:
        """Return the number of corrections and switches so far; it never decreases."""
        transitions = self._tree.companion(Transitions)
        return 0 if transitions is None else transitions.count

    def correction_of(self, child: str) -> Pose:
        """
        Return the newest correction of an edge, even while it is in transition to it.

        After the transition, ``parent_T_child`` is this correction times the inserted pose.
        Without corrections it is the identity.
        """
        with self._lock:
            return correction_of(self._tree, child)

    def smoothed(self) -> PlainSnapshot:
        """
        Return a snapshot with all corrections applied to the past, too.

        The live tree is inaccurate during a blend, which avoids jumps, and its past is never
        corrected. In this snapshot every sample has the correction for its own stamp, which is
        interpolated between two corrections. An edge that changed its source has the samples
        of its present source from their beginning. It is meant for maps and post-processing.
        """
        with self._lock:
            return self._snapshot_of(self._smoothed())

    def _smoothed(self) -> Tree:
        return smoothed(self._tree)
