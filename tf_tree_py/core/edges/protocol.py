# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
What the tree asks of an edge's history, whatever kind it is.

A kind says how poses between samples come about: static, interpolated, held, and
whatever comes later. The tree, the paths and the many-stamp lookups know these
protocols only.
"""

from collections.abc import Iterator
from typing import Protocol, TypeGuard

from .columns import Columns
from .track import EdgeTrack
from ..errors import ExtrapolationException
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Stamps

Stretch = tuple[str, int, int]
"""A parent, and from which stamp up to which it is one; the last stamp is not part of that."""


class History(Protocol):
    """
    What is known of one child frame over time.

    Not safe for several threads: the buffer's lock is.

    :ivar child: the frame whose history it is.
    :ivar authority: who sent the last sample that was taken.
    :ivar kind: what it is, for people. A history never changes its kind: where an edge of
        the tree changes its kind, it gets a new history.
    :ivar is_static: whether the pose is the same at all times. Of the others ``moves``
        is true, and they are a ``MovingHistory``.
    """

    child: str
    authority: str
    kind: str
    is_static: bool

    def __len__(self) -> int:
        """Return how many samples are stored."""

    @property
    def parent(self) -> str | None:
        """Return the newest sample's parent; None while there is none, or after the end."""

    @property
    def fixed_parent(self) -> bool:
        """Return whether one parent holds from end to end: a path through it can be kept."""

    @property
    def oldest_stamp(self) -> int | None:
        """Return where the span begins, nanoseconds; None while there is no sample."""

    @property
    def latest_stamp(self) -> int | None:
        """Return where the span ends, nanoseconds; ``LATEST`` for a static edge."""

    # --- answers

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return ``parent_T_child`` at a stamp.

        :param stamp: nanoseconds; 0 is a time here.
        :raises ExtrapolationException: there is no data for the stamp.
        """

    def track(self, first: int, last: int) -> EdgeTrack:
        """
        Return a copy of what it takes to answer many stamps.

        :param first: nanoseconds; from this stamp to ``last`` there is data.
        """

    def twists(self, stamps: Stamps) -> Array | None:
        """
        Return how fast the child moves in its parent at stamps, in the child's axes.

        :param stamps: (N,) nanoseconds, for which there is data.
        :return: (N, 6) metres and radians a second; None where only poses are known.
        """

    # --- who is the parent

    def parent_at(self, stamp: int) -> str | None:
        """Return the parent at a stamp; None where ``sample`` would raise."""

    def possible_parents(self, stamp: int) -> set[str] | None:
        """Return the parents that may still turn out to hold at a stamp; None if any may."""

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """
        Yield each parent in a stretch of time, and from when to when it is the parent.

        The first may begin before it, and the last end after it.
        """

    def has_named(self, parent: str) -> bool:
        """Return whether a stored sample names a parent."""

    # --- what arrives

    def append(self, stamp: int, pose: bytes) -> bool:
        """
        Take the next sample of the parent that all before it name: the common case.

        :param pose: seven doubles in the machine's byte order.
        :return: False, with nothing done, when it is another case: see ``insert``.
        """

    def goes_on(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether a sample leaves every path as it is."""

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """
        Take a sample, unless it is older than what is kept, or the edge takes none.

        :return: False when the sample was refused.
        """

    def is_too_old(self, stamp: int) -> bool:
        """Return whether data for a stamp would come too late, as ``insert`` has it."""

    def next_stamp(self, stamp: int) -> int:
        """Return the stamp of the first sample that is newer; ``FOREVER`` if there is none."""

    def clear(self) -> None:
        """Forget what moves; a static edge stays."""

    def copy(self) -> 'History':
        """Return a history of its own with the same samples."""


class MovingHistory(History, Protocol):
    """
    The history of an edge whose samples belong to a time.

    :ivar cache_time: how far the oldest sample may lie behind the newest, nanoseconds.
    """

    cache_time: int

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """
        Take many samples of the parent that all before them name, as ``insert`` one by one.

        :param stamps: (n,) in order of arrival, n > 0; none is older than the window when
            its turn comes.
        :param poses: (n, 7) ``parent_T_child``, with unit quaternions.
        """

    def columns(self) -> Columns:
        """
        Return samples for programs that interpolate between them, such as readers of a recording.

        While they are held, nothing can be added.
        """

    def next_turn(self, stamp: int) -> int:
        """Return how new the newest sample has to be, to change what is known of a stamp."""

    def fell_silent(self, stamp: int) -> bool:
        """Return whether nothing came for so long before a stamp that the edge may have ended."""

    def end(self) -> None:
        """Let the edge end with its newest sample, until another comes."""

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return what to raise for a stamp that there is no data for."""


def moves(history: History | None) -> TypeGuard[MovingHistory]:
    """Return whether there is a history, and its samples belong to a time."""
    return history is not None and not history.is_static
