# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Data beside the samples of a tree's edges, such as covariances.

A tree has at most one companion of each kind, copies and saves it with the samples, and does not
know which kinds exist. Each kind registers itself, so that files can contain it.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

from ..edges.protocol import History
from ..edges.storage import Arrays, Stored


class Companion:
    """
    Data beside the samples of a tree.

    A tree calls these methods when its samples change. By default they do nothing, and the
    companion is neither copied nor saved.

    It is not thread-safe; the buffer's lock protects it.

    :cvar key: its name in the header of a file.
    """

    key: ClassVar[str] = ''

    def copy(self) -> 'Companion | None':
        """Return an independent copy for a copy of the tree; None: that tree gets none."""
        return None

    def clear(self, histories: Mapping[str, History]) -> None:
        """Remove the data of moving edges, as ``Tree.clear`` does."""

    def remove(self, frame: str) -> None:
        """Remove the data of a frame's edge to its parent."""

    def structure_changed(self) -> None:
        """Remove what depends on the parents of frames."""

    def frozen(self, arrays: Arrays) -> Any:
        """Return facts for ``thawed``, of types that JSON supports, and add its arrays."""

    @classmethod
    def thawed(cls, stored: Stored) -> 'Companion':
        """
        Return the companion from the header ``stored``, in which ``key`` has its facts.

        :raises ValueError: the facts are not valid for it.
        """
        raise ValueError(f'{cls.key!r} cannot be stored')


COMPANIONS: dict[str, type[Companion]] = {}
"""The kinds that files can contain, by key."""

_Kind = TypeVar('_Kind', bound=type[Companion])


def storable(kind: _Kind) -> _Kind:
    """Register a kind of companion that files can contain: a decorator of its class."""
    COMPANIONS[kind.key] = kind
    return kind
