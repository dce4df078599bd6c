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
    InvalidArgumentException,
)
from tf_tree_py.core.stamp import FOREVER, format_span, UNLIMITED
from tf_tree_py.core.text import listed

# How many of the other edges an error lists.
_LISTED = 8
_CHECK = 'tf_doctor reports whether {edge} is silent, late, or stamped by another clock'


class EdgeAge(NamedTuple):
    """
    How old the data of a moving edge is.

    :ivar parent: its parent frame.
    :ivar child: its child frame.
    :ivar authority: its last publisher.
    :ivar stamp: of its newest sample, nanoseconds.
    :ivar age: of its latest pose, nanoseconds: of that sample, or less if the edge holds it for a
        while; negative if that is ahead of the clock.
    """

    parent: str
    child: str
    authority: str
    stamp: int
    age: int


class StaleException(ExtrapolationException):
    """
    The data of an edge is older than ``max_age``, or its age is unknown.

    ``parent``, ``child`` and ``latest`` are those of the edge with the oldest data.

    :ivar age: of the oldest data, nanoseconds; None: the clock has not started.
    :ivar max_age: the limit, nanoseconds.
    :ivar ages: the moving edges between the two frames, those with the oldest data first; none if
        a buffer server answered, which does not say.
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
        what = 'The latest transform' if not self.ages else (
            f'The latest data of the edge {self.parent} -> {self.child}, last published by '
            f'{self.ages[0].authority!r},')
        return f'{what} is {format_span(self.age)} old, and max_age is {limit}{self._query()}'

    def _query(self) -> str:
        if self.source_frame is None and self.target_frame is not None:
            return f', when looking up all frames in [{self.target_frame}]'
        return super()._query()


def stale(age: int | None, max_age: int, ages: Sequence[EdgeAge] = ()) -> StaleException:
    """
    Return the error of a transform that is too old, or whose age is unknown.

    :param age: nanoseconds; None: unknown.
    :param ages: see ``StaleException``.
    """
    oldest = ages[0] if ages else None
    error = StaleException(parent=oldest and oldest.parent, child=oldest and oldest.child,
                           latest=oldest and oldest.stamp)
    error.age, error.max_age, error.ages = age, max_age, tuple(ages)
    return error


def check_ages(edges: Sequence[MovingHistory], now: int, max_age: int) -> None:
    """
    Check that the data of each of some edges is fresh.

    An edge that holds its newest sample for a while gets older only after that.

    :param edges: those that move; without any, nothing can be stale.
    :param now: by the clock of the stamps, nanoseconds; 0: it has not started.
    :raises StaleException: the data of one is older than the limit, or its age is unknown.
    """
    is_known = now > 0
    begin = now - max_age if is_known else FOREVER
    late = [edge for edge in edges if _reach_of(edge) < begin]
    if not late:
        return
    ages = [EdgeAge(str(edge.parent), edge.child, edge.authority, newest_stamp_of(edge),
                    now - _reach_of(edge)) for edge in sorted(edges, key=_reach_of)]
    error = stale(ages[0].age if is_known else None, max_age, ages)
    error.hint = partial(_hint, ages) if is_known else (
        'With use_sim_time, does any node publish /clock?')
    # Before the clock starts, any sample may be fresh.
    error.blocked_on = tuple((edge.child, begin if is_known else _reach_of(edge) + 1)
                             for edge in late)
    raise error


def newest_stamp_of(edge: MovingHistory) -> int:
    """Return the stamp of the newest sample of an edge that is on a path, and so has one."""
    assert edge.newest_stamp is not None
    return edge.newest_stamp


def _reach_of(edge: MovingHistory) -> int:
    assert edge.latest_stamp is not None
    return edge.latest_stamp


def held_back(error: ExtrapolationException, edges: Sequence[MovingHistory]) -> None:
    """
    Explain why a lookup of the latest needs data that an edge no longer has.

    It does so only if that edge once could have had it: an edge that began later needs no other
    to explain the error.

    :param error: of an edge that has no data for the latest common time.
    """
    slowest = min(edges, key=_reach_of)
    if error.requested is not None and any(
            edge.child == error.child and edge.is_too_old(error.requested) for edge in edges):
        error.hint = partial(
            _why_so_old, f'{slowest.parent} -> {slowest.child}', slowest.authority)


def _why_so_old(edge: str, authority: str, live: bool) -> str:
    why = (f'The latest time is so old because nothing newer of the edge {edge}, last published '
           f'by {authority!r}, has arrived')
    return f'{why}: {_CHECK.format(edge=edge)}' if live else why


def _hint(ages: Sequence[EdgeAge], live: bool) -> str:
    oldest, *others = ages
    sentences = []
    if others:
        sentences.append('The other edges: ' + listed(
            [f'{edge.parent} -> {edge.child} {_as_text(edge.age)}' for edge in others], _LISTED))
    if live:
        sentences.append(_CHECK.format(edge=f'{oldest.parent} -> {oldest.child}'))
    return '. '.join(sentences)


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
        if isinstance(max_age, bool):
            raise TypeError
        limit = operator.index(max_age)
    except TypeError:
        raise ArgumentTypeException(
            f'Invalid argument max_age {max_age!r}: it must be integer nanoseconds'
            + (f'. If it is in seconds, pass tf_tree_py.from_seconds({max_age!r})'
               if isinstance(max_age, float) else '')) from None
    if limit < 0:
        raise InvalidArgumentException(
            f'Invalid argument max_age {limit}: it is in nanoseconds, and cannot be negative')
    return limit if limit < UNLIMITED else None
