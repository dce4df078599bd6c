# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The covariances of a tree's edges, beside their samples."""

from collections.abc import Mapping

from tf_tree_py.core.edges.protocol import History, moves
from tf_tree_py.core.edges.storage import Arrays, Facts, Stored
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import bad_name
from tf_tree_py.core.tree.companions import Companion, storable
from tf_tree_py.core.tree.tree import Tree

from .covariance_history import Uncertainty


@storable
class EdgeCovariances(Companion):
    """
    The covariances of a tree's edges.

    :ivar by_edge: the covariances of each edge that has any, by (parent, child).
    """

    key = 'uncertainty'

    def __init__(self) -> None:
        self.by_edge: dict[tuple[str, str], Uncertainty] = {}

    def copy(self) -> 'EdgeCovariances':
        """Return an independent copy."""
        twin = EdgeCovariances()
        twin.by_edge = {edge: one.copy() for edge, one in self.by_edge.items()}
        return twin

    def clear(self, histories: Mapping[str, History]) -> None:
        """Remove the covariances of edges that move; see ``Tree.clear``."""
        self.by_edge = {edge: one for edge, one in self.by_edge.items()
                        if not moves(histories.get(edge[1]))}

    def remove(self, frame: str) -> None:
        """Remove the covariances of a frame's edges to all its parents."""
        self.by_edge = {edge: one for edge, one in self.by_edge.items() if edge[1] != frame}

    def frozen(self, arrays: Arrays) -> list[Facts]:
        """Return the facts for ``thawed``, and add the covariances to arrays."""
        return [{'parent': parent, 'child': child} | one.frozen(arrays)
                for (parent, child), one in self.by_edge.items()]

    @classmethod
    def thawed(cls, stored: Stored) -> 'EdgeCovariances':
        """Return the frozen covariances; they use the memory in place."""
        twin = cls()
        twin.by_edge = {(part.one('parent', str), part.one('child', str)): Uncertainty.thawed(part)
                        for part in stored.parts(cls.key)}
        return twin


def set_covariance(tree: Tree, parent: str, child: str, stamp: int, covariance: Array,
                   authority: str) -> list[Incident]:
    """
    Take the covariance (6, 6) of an edge at a stamp; the edge need not have poses yet.

    :return: refusals, because the names come from messages; nearly always empty.
    """
    by_edge = tree.companion_or_new(EdgeCovariances).by_edge
    known = by_edge.get((parent, child))
    if known is None:
        bad = bad_name(parent, child, stamp, authority, tree.max_name_bytes)
        if bad:
            return [bad]
        if len(by_edge) >= tree.max_frames:
            return [Incident(
                Kind.TOO_MANY_FRAMES, parent, child, stamp, authority, 'the buffer already has '
                f'covariances of {len(by_edge)} edges, its limit (max_frames)')]
        known = by_edge[parent, child] = Uncertainty()
    known.insert(stamp, covariance, tree.cache_time)
    return []


def known_covariances(tree: Tree, parent: str, child: str) -> Uncertainty | None:
    """Return the covariances of an edge; None if it has none."""
    known = tree.companion(EdgeCovariances)
    return None if known is None else known.by_edge.get((parent, child))
