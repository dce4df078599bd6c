# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Queries about the sources of edges."""

from tf_tree_py.core.tree.tree import Tree

from .source_samples import EdgeSource, smoothed, Sources
from ..corrections.queries import CorrectionQueries


class SourceQueries(CorrectionQueries):
    """The sources of edges, thread-safe."""

    def sources_of(self, child: str) -> list[EdgeSource]:
        """Return the sources of an edge, in order of their first samples."""
        with self._lock:
            known = self._tree.companion(Sources)
            sources = known.by_child.get(child) if known is not None else None
            return sources.listed() if sources is not None else []

    def _smoothed(self) -> Tree:
        twin = super()._smoothed()
        smoothed(self._tree, twin)
        return twin
