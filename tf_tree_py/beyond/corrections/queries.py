# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Queries about the corrections of edges."""

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.core.tree.tree import Tree

from .absorbing import correction_of, smoothed, Transitions


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

    def _smoothed(self) -> Tree:
        """Return a copy of the tree with all corrections applied to the past, too."""
        return smoothed(self._tree)
