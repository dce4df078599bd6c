# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Data beside the samples of a tree's edges, such as covariances.

A tree has at most one companion of each class, copies and saves it with the samples, and does not
know which classes exist.
"""

from collections.abc import Mapping
from typing import ClassVar

from ..edges.protocol import History


class Companion:
    """
    Data beside the samples of a tree.

    A tree calls these methods when its samples change. By default they do nothing, and the
    companion is neither copied nor saved.

    It is not thread-safe; the buffer's lock protects it.

    :cvar key: its name in the header of a file; '' for one that is not saved. The others have a
        method ``save`` and a class method ``load``: see ``files.tree_file``.
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
