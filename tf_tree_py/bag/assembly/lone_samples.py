# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reports single samples whose stamps are far from all others of their edge."""

from array import array
from collections.abc import Iterator, Mapping
from typing import TypeAlias

import numpy as np
from tf_tree_py.core.messages.incidents import one_of
from tf_tree_py.core.stamp import format_span, format_stamp, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps
from tf_tree_py.health.measures.sample_rows import Places
from tf_tree_py.health.measures.timing import lone_stamps_of

from .decoding import Edge

LONE_STAMP = 'lone stamp'
"""The reason of their anomalies."""

_DAY_S = 86_400
_Columns: TypeAlias = tuple['array[int]', 'array[int]']


class ArrivalOrder:
    """The stamps of every edge in order of arrival, with the times of arrival."""

    def __init__(self) -> None:
        self._columns: dict[Edge, _Columns] = {}
        self._authorities: dict[Edge, dict[str, None]] = {}

    def add(self, edge: Edge, received: int, stamp: int, authority: str) -> None:
        """Add the next sample of an edge."""
        for column, value in zip(self._of(edge, authority), (received, stamp), strict=True):
            column.append(value)

    def add_many(self, edge: Edge, received: Stamps, stamps: Stamps, authority: str) -> None:
        """Add the next samples of an edge."""
        for column, values in zip(self._of(edge, authority), (received, stamps), strict=True):
            column.frombytes(values.tobytes())

    def _of(self, edge: Edge, authority: str) -> _Columns:
        self._authorities.setdefault(edge, {})[authority] = None
        return self._columns.setdefault(edge, (array('q'), array('q')))

    def stamps(self) -> Mapping[Edge, Stamps]:
        """Return the stamps of each edge."""
        return {edge: np.frombuffer(stamps, np.int64)
                for edge, (_, stamps) in self._columns.items()}

    def lone(self) -> Iterator[tuple[Edge, Stamps, str]]:
        """Yield the stamps of the lone samples of an edge; about the first, and what to do."""
        columns = {edge: (np.frombuffer(received, np.int64), np.frombuffer(stamps, np.int64))
                   for edge, (received, stamps) in self._columns.items()}
        for edge, places in lone_stamps_of(columns).items():
            received, stamps = columns[edge]
            yield edge, stamps[places], _detail(
                received, stamps, places, one_of(self._authorities[edge]))


def _detail(received: Stamps, stamps: Stamps, places: Places, authority: str) -> str:
    place = int(places[0])
    stamp, arrived = int(stamps[place]), int(received[place])
    beside = int(stamps[place + 1 if place == 0 else place - 1])
    others = np.delete(stamps, places)
    first, last = int(others.min()), int(others.max())
    return (f'{_date(stamp)}, {_how_far(beside - stamp)} its neighbours; received at '
            f'{format_stamp(arrived)} s, from {authority}. '
            + ('Lookups around its stamp use it' if first <= stamp <= last else
               'Lookups between it and the others are interpolated over that time: leave it out '
               f'with tf_export --from {first} --to {last}, or start and stop of stamps_at_rate'))


def _date(stamp: int) -> str:
    return f"{np.datetime64(stamp // NANOSECONDS_PER_SECOND, 's')} UTC"


def _how_far(span: int) -> str:
    """Return how far a stamp is before others, or after them if the span is negative."""
    days, word = abs(span) / 1e9 / _DAY_S, 'before' if span > 0 else 'after'
    return f'{days:,.0f} days {word}' if days >= 2.0 else f'{format_span(abs(span))} {word}'
