# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The ages of edges by the clock that their stamps follow, and the error of a stale transform.

Pure functions of the edges, a time and a limit; those that take edges are called with the buffer's
lock. Static edges have no age.
"""

from collections.abc import Sequence
from functools import partial
import operator
from typing import NamedTuple, SupportsIndex

from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import (
    ArgumentTypeException,
    ExtrapolationException,
    Hint,
    InvalidArgumentException,
)
from tf_tree_py.core.stamp import format_span, UNLIMITED
from tf_tree_py.core.text import listed

# How many of the other edges an error lists.
_LISTED = 8


class EdgeAge(NamedTuple):
    """
    The newest sample of a moving edge.

    :ivar parent: its parent frame.
    :ivar child: its child frame.
    :ivar authority: its last publisher.
    :ivar stamp: of its newest sample, nanoseconds.
    :ivar age: how old that is, nanoseconds; negative if the stamp is ahead of the clock.
    """

    parent: str
    child: str
    authority: str
    stamp: int
    age: int


class StaleException(ExtrapolationException):
    """
    The latest transform is older than ``max_age``, or its age is unknown.

    ``parent``, ``child`` and ``latest`` are those of the edge that limits it.

    :ivar age: of the latest transform, nanoseconds; None: the clock has not started.
    :ivar max_age: the limit, nanoseconds.
    :ivar ages: the moving edges between the two frames, the oldest first.
    """

    age: int | None = None
    max_age: int | None = None
    ages: tuple[EdgeAge, ...] = ()

    def describe(self) -> str:
        """Return a sentence with the age, the limit, and the edge that is too old."""
        if self.max_age is None:
            return super().describe()
        limit = format_span(self.max_age)
        if self.age is None:
            return (f'The age of the latest transform is unknown, and max_age is {limit}: the '
                    f'clock that the stamps follow has not started{self._query()}')
        what = f'The latest transform is {format_span(self.age)} old, and max_age is {limit}'
        if self.ages:
            what += (f': the edge {self.parent} -> {self.child}, last published by '
                     f'{self.ages[0].authority!r}, has nothing newer')
        return what + self._query()

    def _query(self) -> str:
        if self.source_frame is None and self.target_frame is not None:
            return f', when looking up all frames in [{self.target_frame}]'
        return super()._query()


def stale(stamp: int, now: int, max_age: int, ages: Sequence[EdgeAge] = (),
          hint: Hint = '') -> StaleException:
    """
    Return the error of a transform that is too old, or whose age is unknown.

    :param stamp: of the transform, nanoseconds.
    :param now: by the clock of the stamps, nanoseconds; 0: it has not started.
    :param ages: see ``StaleException``.
    """
    oldest = ages[0] if ages else None
    error = StaleException(
        parent=oldest and oldest.parent, child=oldest and oldest.child,
        latest=oldest and oldest.stamp, hint=hint)
    error.age = now - stamp if now > 0 else None
    error.max_age, error.ages = max_age, tuple(ages)
    return error


def check_age(edges: Sequence[MovingHistory], stamp: int, now: int, max_age: int) -> None:
    """
    Check the age of the latest transform along some edges.

    :param edges: those that move; without any, nothing can be stale.
    :param stamp: the newest for which all of them have data, nanoseconds.
    :param now: see ``stale``.
    :raises StaleException: it is older than the limit, or its age is unknown.
    """
    if not edges or (now > 0 and now - stamp <= max_age):
        return
    # Those that limit the stamp come first, also if others hold an older sample.
    order = sorted(edges, key=lambda edge: (_reach_of(edge) > stamp, newest_stamp_of(edge)))
    ages = _ages_of(order, now)
    error = stale(stamp, now, max_age, ages, partial(_hint, ages, now > 0))
    # An edge that holds its sample may already reach the limit: then any next sample may help.
    late = [edge for edge in edges if _reach_of(edge) < now - max_age] or order
    error.blocked_on = tuple((edge.child, max(now - max_age, stamp + 1)) for edge in late)
    raise error


def check_each_age(edges: Sequence[MovingHistory], now: int, max_age: int) -> None:
    """
    Check the age of each of some edges; see ``check_age``.

    An edge that holds its newest sample for a while gets older only after that.
    """
    oldest = min(edges, key=_reach_of, default=None)
    if oldest is not None:
        check_age(edges, _reach_of(oldest), now, max_age)


def _ages_of(edges: Sequence[MovingHistory], now: int) -> list[EdgeAge]:
    """Return the ages of edges."""
    return [EdgeAge(str(edge.parent), edge.child, edge.authority, stamp, now - stamp)
            for edge in edges for stamp in [newest_stamp_of(edge)]]


def newest_stamp_of(edge: MovingHistory) -> int:
    """Return the stamp of the newest sample of an edge that is on a path, and so has one."""
    assert edge.newest_stamp is not None
    return edge.newest_stamp


def _reach_of(edge: MovingHistory) -> int:
    assert edge.latest_stamp is not None
    return edge.latest_stamp


def _hint(ages: Sequence[EdgeAge], has_started: bool, live: bool) -> str:
    if not has_started:
        return 'With use_sim_time, does any node publish /clock?'
    oldest, *others = ages
    text = ''
    if others:
        text = 'The other edges: ' + listed(
            [f'{edge.parent} -> {edge.child} {_as_text(edge.age)}' for edge in others],
            _LISTED) + '. '
    if live:
        text += (f'tf_doctor reports whether {oldest.parent} -> {oldest.child} is silent, late, '
                 'or stamped by another clock')
    return text.removesuffix('. ')


def _as_text(age: int) -> str:
    return format_span(age) if age >= 0 else f'{format_span(-age)} ahead of the clock'


def checked_max_age(max_age: SupportsIndex) -> int | None:
    """
    Return a caller's limit as a plain int; None for any age.

    :param max_age: nanoseconds; ``UNLIMITED`` for any age.
    :raises ArgumentTypeException: not an integer.
    :raises InvalidArgumentException: negative.
    """
    try:
        limit = operator.index(max_age)
    except TypeError:
        raise ArgumentTypeException(
            f'Invalid argument max_age {max_age!r}: it must be integer nanoseconds. If it is in '
            f'seconds, pass tf_tree_py.from_seconds({max_age!r})') from None
    if limit < 0:
        raise InvalidArgumentException(
            f'Invalid argument max_age {limit}: it is in nanoseconds, and cannot be negative')
    return limit if limit < UNLIMITED else None
