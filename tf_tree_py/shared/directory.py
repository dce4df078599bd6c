# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The directory of a shared tree: all that changes rarely, as JSON.

A reader checks its checksum before it reads it, so what is here was written by ``as_bytes``.
"""

from collections.abc import Mapping, Sequence
import json
from types import MappingProxyType
from typing import cast, NamedTuple

from tf_tree_py.core.edges.interpolation import LINEAR
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.tree.climb import Cleared, ClearedEdge
from tf_tree_py.core.tree.tree import Tree

from .block_samples import BlockSamples
from .errors import SharedTreeException

Reception = Mapping[str, object]
"""How transforms are received: the options of a listener by their names, as in JSON."""


class Entry(NamedTuple):
    """
    One edge, in the order of the rows.

    :ivar parent: of the newest sample, unless the samples have codes.
    :ivar pose: of a static edge.
    :ivar coded: whether each sample has a code for its parent.
    :ivar ends: stamps of the samples at which the edge ended.
    """

    child: str
    parent: str | None
    pose: PoseTuple | None
    coded: bool
    ends: list[int]


class Failures(NamedTuple):
    """How often all waits have failed, and the last error; see ``Waiting.fail``."""

    number: int = 0
    last: str = ''


class Directory(NamedTuple):
    """
    The edges of a tree, and what readers need besides the samples.

    :ivar version: see ``Tree``: some changes of the structure are changes of samples alone.
    :ivar names: what the codes of parents and publishers stand for.
    :ivar reception: how the transforms are received, for readers that need to know.
    :ivar cleared: see ``Tree.cleared``.
    """

    version: int = 0
    cache_time: int = 0
    frames: Sequence[str] = ()
    names: Sequence[str] = ()
    edges: Sequence[Entry] = ()
    failures: Failures = Failures()
    reception: Reception = MappingProxyType({})
    cleared: Cleared | None = None

    def as_bytes(self) -> bytes:
        """Return the directory for ``from_bytes``."""
        cleared = self.cleared and (self.cleared.why, list(self.cleared.edges.items()))
        return json.dumps([*self[:-2], dict(self.reception), cleared]).encode()


def from_bytes(data: bytes) -> Directory:
    """Return a directory whose checksum is right."""
    version, cache_time, frames, names, edges, failures, reception, cleared = json.loads(data)
    if cleared is not None:
        why, lost = cleared
        cleared = Cleared(why, {child: ClearedEdge(*edge) for child, edge in lost})
    return Directory(version, cache_time, frames, names, [_entry_of(*edge) for edge in edges],
                     Failures(*failures), reception, cleared)


def _entry_of(child: str, parent: str | None, pose: list[float] | None, coded: bool,
              ends: list[int]) -> Entry:
    return Entry(child, parent, cast('PoseTuple | None', pose and tuple(pose)), coded, ends)


def directory_of(tree: Tree, names: list[str], failures: Failures,
                 reception: Reception) -> Directory:
    """
    Return the directory of a tree.

    :raises SharedTreeException: an edge is neither static nor one of samples.
    """
    return Directory(tree.version, tree.cache_time, list(tree.frames), names,
                     [_entry(history) for history in tree.histories.values()], failures,
                     reception, tree.cleared)


def _entry(history: object) -> Entry:
    if type(history) is StaticHistory:
        return Entry(history.child, history.parent, history.pose, False, [])
    if type(history) is BlockSamples and history.interpolation is LINEAR:
        return Entry(history.child, history.parent, None, history.coded, history.stored_ends())
    raise SharedTreeException(
        f'A tree with an edge that is a {type(history).__name__} cannot be shared, or that has an '
        'interpolation of its own: samples and static transforms can')
