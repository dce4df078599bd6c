# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Write measured figures into the text of pages, from the tables of results.

A passage is a part of a page with a ``{}`` in place of each figure. Its words find it on the page,
where only the figures change.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Context, Decimal, ROUND_HALF_UP
from pathlib import Path
import re
from typing import NamedTuple, Protocol

from .rows import OURS
from .stored import Results
from .timing import Spread

_NUMBER = r'\d[\d,]*(?:\.\d+)?'
# Of the decimal numbers of the tables, so that 0.145 becomes 0.15.
_TWO_DIGITS = Context(prec=2, rounding=ROUND_HALF_UP)


class Figure(Protocol):
    """
    One figure in a text.

    :ivar pattern: a regular expression that matches all texts of such a figure.
    :ivar contestants: those that it quotes.
    """

    @property
    def pattern(self) -> str:
        """Return the pattern."""

    @property
    def contestants(self) -> tuple[str, ...]:
        """Return their names in the results."""

    def text(self, results: Results) -> str:
        """
        Return the figure as it is written.

        :raises KeyError: it was not measured.
        """


@dataclass(frozen=True)
class Number:
    """
    A number of a table, with two significant digits.

    :ivar part: 'least', 'median' or 'greatest'.
    :ivar factor: from the unit of the table to that of the text.
    :ivar inverse: the text has the factor divided by the number.
    """

    group: str
    name: str
    part: str = 'median'
    factor: float = 1.0
    inverse: bool = False
    pattern = _NUMBER

    def text(self, results: Results) -> str:
        """Return the number."""
        number = getattr(self.spread(results), self.part)
        return rounded(self.factor / number if self.inverse else number * self.factor)

    @property
    def contestants(self) -> tuple[str, ...]:
        """Return those that the number is of."""
        raise NotImplementedError

    def spread(self, results: Results) -> Spread:
        """Return the number and its ends."""
        raise NotImplementedError

    def and_ends(self) -> 'tuple[Number, Number, Number]':
        """Return the median, the least and the greatest."""
        return self, replace(self, part='least'), replace(self, part='greatest')


@dataclass(frozen=True)
class Measured(Number):
    """
    A measurement of a contestant.

    :ivar of_unit: the unit of the row, where several rows have one name.
    """

    contestant: str = OURS
    of_unit: str = '*'

    @property
    def contestants(self) -> tuple[str, ...]:
        """Return the contestant."""
        return (self.contestant,)

    def spread(self, results: Results) -> Spread:
        """Return the number and its ends."""
        return results.measured(self.group, self.name, self.contestant, self.of_unit)


@dataclass(frozen=True)
class Ratio(Number):
    """A number of the table of ratios."""

    unit: str = ''

    @property
    def contestants(self) -> tuple[str, ...]:
        """Return what the unit is a multiple of."""
        return (self.unit.removeprefix('x ').removeprefix('a loop of '),)

    def spread(self, results: Results) -> Spread:
        """Return the number and its ends."""
        return results.ratio(self.group, self.name, self.unit)


@dataclass(frozen=True)
class FasterUpTo:
    """
    The greatest of these depths up to which lookups take no longer than another contestant's.

    The fastest rounds are compared.

    :ivar names: of the rows, without their depth.
    """

    names: str
    contestant: str
    depths: tuple[int, ...]
    ours: str = OURS
    pattern = _NUMBER

    @property
    def contestants(self) -> tuple[str, ...]:
        """Return both contestants."""
        return self.ours, self.contestant

    def text(self, results: Results) -> str:
        """Return the depth; 0 if the other contestant is always faster."""
        reached = 0
        for depth in self.depths:
            name = f'{self.names}, depth {depth}'
            ours, theirs = (results.measured('depth', name, contestant).least
                            for contestant in (self.ours, self.contestant))
            if ours > theirs:
                break
            reached = depth
        return str(reached)


@dataclass(frozen=True)
class Date:
    """The day of the run on a page of results."""

    page: str
    pattern = r'\d+ \w+ \d{4}'
    contestants = ()

    def text(self, results: Results) -> str:
        """Return such as '21 November 2026'."""
        return results.runs[self.page].date


@dataclass(frozen=True)
class Commit:
    """The commit that was measured for a page of results."""

    page: str
    pattern = r'\w+'
    contestants = ()

    def text(self, results: Results) -> str:
        """Return its short hash."""
        return results.runs[self.page].commit


class Passage(NamedTuple):
    """
    A part of a page with figures.

    :ivar page: its path in the repository.
    :ivar words: its text, with ``{}`` for each figure; where it has a space, the page may have a
        line break.
    """

    page: str
    words: str
    figures: Sequence[Figure]

    def find(self, text: str) -> re.Match[str]:
        """
        Return the place of the passage in the text of its page, with a group for each figure.

        :raises ValueError: the page does not contain it exactly once.
        """
        words = [re.sub(r'(\\ )+', r'\\s+', re.escape(part)) for part in self.words.split('{}')]
        pattern = words[0] + ''.join(
            f'({figure.pattern}){part}'
            for figure, part in zip(self.figures, words[1:], strict=True))
        found = list(re.finditer(pattern, text))
        if len(found) != 1:
            raise ValueError(f'{self.page} has {len(found)} places of: {self.words}')
        return found[0]

    def renewed(self, text: str, results: Results) -> str:
        """
        Return the text of the page with the figures of these results.

        :raises KeyError: a figure was not measured.
        """
        found = self.find(text)
        for number, figure in reversed(list(enumerate(self.figures, 1))):
            begin, end = found.span(number)
            text = text[:begin] + figure.text(results) + text[end:]
        return text


def renew(repository: Path, passages: Iterable[Passage], results: Results) -> None:
    """Write the figures of these results into all passages."""
    for page in dict.fromkeys(passage.page for passage in passages):
        document = repository / page
        text = document.read_text()
        for passage in passages:
            if passage.page == page:
                text = passage.renewed(text, results)
        document.write_text(text)


def missing(passages: Iterable[Passage], results: Results) -> list[str]:
    """Return what the passages quote and these results lack."""
    lacking = dict[str, None]()
    for passage in passages:
        for figure in passage.figures:
            try:
                figure.text(results)
            except KeyError as error:
                lacking[str(error.args[0])] = None
    return list(lacking)


def quoted(passages: Iterable[Passage], absent: Mapping[str, str]) -> dict[str, str]:
    """Return those of the absent contestants that a passage quotes."""
    names = {name for passage in passages for figure in passage.figures
             for name in figure.contestants}
    # A contestant may be measured in several ways, such as 'rosbags, raw'.
    return {name: reason for name, reason in absent.items()
            if any(other == name or other.startswith(f'{name}, ') for other in names)}


def rounded(value: float) -> str:
    """Format a number with two significant digits, and a comma after the thousands."""
    if not value:
        return '0'
    number = _TWO_DIGITS.create_decimal(str(value))
    number = number.quantize(Decimal(1).scaleb(number.adjusted() - 1))
    return f'{number:,.0f}' if abs(number) >= 10 else f'{number:f}'
