# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge that never moves: one pose, valid at all times.

The tree inserts nothing new into it: another pose or parent is another object. Cached paths
contain the products of successive static edges, and are forgotten with the object.
"""

from collections.abc import Iterator

import numpy as np

from .protocol import Stretch
from .tracks import ConstantTrack
from ..errors import no_truth
from ..geometry.chain import PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, LATEST
from ..times import Stamps


class StaticHistory:
    """One edge that never moves; see ``History``."""

    __slots__ = ('child', 'parent', 'pose', 'authority')  # tree/path_in_c.c reads the pose

    described_as = 'static'
    is_static = True
    takes_samples = True
    fixed_parent = True
    oldest_stamp = LATEST
    newest_stamp = LATEST
    latest_stamp = LATEST

    def __init__(self, child: str, parent: str, pose: PoseTuple, authority: str = '') -> None:
        self.child = child
        self.parent = parent
        self.pose = pose
        self.authority = authority

    def __len__(self) -> int:
        return 1

    __bool__ = no_truth

    def sample(self, stamp: int) -> PoseTuple:
        """Return ``parent_T_child``, the same at every stamp."""
        return self.pose

    def neighbours(self, first: int, last: int) -> tuple[float, ...]:
        """Return the pose twice."""
        return self.pose + self.pose

    def track(self, first: int, last: int) -> ConstantTrack:
        """Return a track with the pose for any stamps."""
        return ConstantTrack(self.pose)

    def twists(self, stamps: Stamps) -> Array:
        """Return zeros, because it does not move."""
        return np.zeros((len(stamps), 6))

    def parent_at(self, stamp: int) -> str:
        """Return the parent, the same at every stamp."""
        return self.parent

    def possible_parents(self, stamp: int) -> set[str]:
        """Return the only parent."""
        return {self.parent}

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """Yield the only parent, for all time."""
        yield self.parent, BEGINNING, FOREVER

    def has_named(self, parent: str) -> bool:
        """Return whether this is the parent."""
        return parent == self.parent

    def append(self, stamp: int, pose: bytes) -> bool:
        """Return False: a static edge has no next sample."""
        return False

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether a sample equals the stored one, as static broadcasters repeat it."""
        return parent == self.parent and pose == self.pose

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Replace the stored sample, regardless of the stamp."""
        self.parent, self.pose = parent, pose
        return True

    def is_too_old(self, stamp: int) -> bool:
        """Return False: it is valid at all times."""
        return False

    def next_stamp(self, stamp: int) -> int:
        """Return ``FOREVER``: there is no newer sample."""
        return FOREVER

    def clear(self) -> None:
        """Keep the sample: a static edge stays, as in tf2."""

    def copy(self) -> 'StaticHistory':
        """Return an independent copy."""
        return StaticHistory(self.child, self.parent, self.pose, self.authority)
