# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The interface of an edge's history to the tree, for all kinds; and its copy for many stamps.

The tree, the paths and the lookups at many stamps use only these protocols, never a class. An
edge of samples chooses its poses between them by its ``Interpolation``; that needs no history of
its own.

The rules:

- The buffer's lock protects a history, also while it is only read: samples remember where their
  window begins, and the newest pose.
- Whoever changes a parent, or the pose of a static edge, lets the tree forget its cached paths. Or
  else lookups go on along the old one.
- A track is a copy of a history, with its own evaluation. It is made with the lock held, and used
  without it: it must share nothing with the history that can still change.
"""

from collections.abc import Iterator
from typing import Protocol, TypeGuard

from .packed import Columns
from ..errors import ExtrapolationException
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Stamps


class EdgeTrack(Protocol):
    """
    One edge from a first to a last stamp.

    :ivar knots: (n,) sorted stamps; the edge moves smoothly between successive ones. Empty if
        it never moves.
    """

    knots: Stamps

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses at times after stamps.

        :param stamps: (...) nanoseconds.
        :param since: (...) nanoseconds after the stamps, at most up to the next knot, which is
            then approached from below; None: zero.
        :return: (7, ...), of any shape that broadcasts with that of stamps and since.
        """

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return the largest motion between successive stamps.

        The error bound of an interpolating polynomial uses it, and assumes motion at a constant
        speed between knots. A kind that moves differently returns infinity, and is then
        evaluated at every stamp.

        :param knots: (n,) sorted, n > 1; its own knots between the first and the last are
            included.
        :return: the angle, radians, and the distance, metres.
        """


# --- histories

Stretch = tuple[str, int, int]
"""A parent, and the interval of stamps in which it is the parent, without the last stamp."""


class History(Protocol):
    """
    The data of one child frame over time.

    It is not thread-safe; the buffer's lock protects it.

    These never change: if a static edge begins to move, the tree gives it another history.

    :ivar child: the frame whose history it is.
    :ivar authority: the publisher of the last accepted sample.
    :ivar described_as: for texts, such as 'static'.
    :ivar is_static: whether the pose is the same at all times. For other histories ``moves``
        is true, and they are a ``MovingHistory``.
    :ivar takes_samples: whether samples can be added; a curve takes none.
    """

    child: str
    authority: str
    described_as: str
    is_static: bool
    takes_samples: bool

    def __len__(self) -> int:
        """Return the number of stored samples."""

    @property
    def parent(self) -> str | None:
        """Return the newest sample's parent; None without samples, or after the end."""

    @property
    def fixed_parent(self) -> bool:
        """Return whether the parent never changes, so that paths through it can be cached."""

    @property
    def oldest_stamp(self) -> int | None:
        """Return the earliest stamp with a pose, nanoseconds; None without samples."""

    @property
    def newest_stamp(self) -> int | None:
        """Return the stamp of the newest sample, nanoseconds; ``LATEST`` for a static edge."""

    @property
    def latest_stamp(self) -> int | None:
        """
        Return the last stamp with a pose, nanoseconds; ``LATEST`` for a static edge.

        It is the newest stamp, or later if the edge holds its newest sample for a while.
        """

    # --- poses

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return ``parent_T_child`` at a stamp.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :raises ExtrapolationException: there is no data for the stamp.
        """

    def neighbours(self, first: int, last: int) -> tuple[float, ...] | None:
        """
        Return the poses at two stamps, 14 numbers; None without data, or with a sample between.

        :param first: nanoseconds, less than ``last``.
        """

    def track(self, first: int, last: int) -> EdgeTrack:
        """
        Return a copy of the data for lookups at many stamps.

        :param first: nanoseconds; there is data from this stamp to ``last``.
        """

    def twists(self, stamps: Stamps) -> Array | None:
        """
        Return the twists of the child relative to its parent at stamps, in the child's axes.

        :param stamps: (N,) nanoseconds, for which there is data.
        :return: (N, 6) metres and radians per second; None if only poses are known.
        """

    # --- the parent

    def parent_at(self, stamp: int) -> str | None:
        """Return the parent at a stamp; None if ``sample`` would raise."""

    def possible_parents(self, stamp: int) -> set[str] | None:
        """Return the parents that later samples may give it at a stamp; None: any frame."""

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """
        Yield each parent in an interval of time, and the interval in which it is the parent.

        The first may begin before the interval, and the last may end after it.
        """

    def has_named(self, parent: str) -> bool:
        """Return whether a stored sample has a given parent."""

    # --- inserting

    def append(self, stamp: int, pose: bytes) -> bool:
        """
        Insert the next sample with the same parent as all before it: the common case.

        :param pose: seven doubles in the machine's byte order.
        :return: False in other cases, without any change: see ``insert``.
        """

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether a sample does not change any path."""

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """
        Insert a sample, unless it is older than the window, or the edge has no samples.

        :return: False if the sample was refused.
        """

    def is_too_old(self, stamp: int) -> bool:
        """Return whether ``insert`` would refuse data for a stamp as too old."""

    def next_stamp(self, stamp: int) -> int:
        """Return the stamp of the first newer sample; ``FOREVER`` if there is none."""

    def clear(self) -> None:
        """Remove all moving data; a static edge stays."""

    def copy(self) -> 'History':
        """Return an independent history with the same samples."""


class MovingHistory(History, Protocol):
    """
    The history of an edge whose samples have stamps.

    :ivar cache_time: how far the oldest sample may be behind the newest, nanoseconds.
    :ivar late: the oldest stamp of the samples that were inserted before the newest one, since
        a reader set it to ``FOREVER``: what was learnt from newer samples is out of date.
    """

    cache_time: int
    late: int

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """
        Insert many samples with the same parent as all before, as ``insert`` for each would.

        :param stamps: (n,) in order of arrival, n > 0; none is older than the window when
            its turn comes.
        :param poses: (n, 7) ``parent_T_child``, with unit quaternions.
        """

    def columns(self) -> Columns:
        """
        Return samples for programs that interpolate between them, such as readers of a recording.

        As long as the columns are referenced, no sample can be added.
        """

    def next_turn(self, stamp: int) -> int:
        """Return what ``latest_stamp`` must reach to change the result at a stamp."""

    def fell_silent(self, stamp: int) -> bool:
        """Return whether the edge was silent so long before a stamp that it may have ended."""

    def end(self) -> None:
        """End the edge at its newest sample, until the next sample arrives."""

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp without data."""


def moves(history: History | None) -> TypeGuard[MovingHistory]:
    """Return whether there is a history, and its samples have stamps."""
    return history is not None and not history.is_static
