# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a lab: tables, the law that they show, and numbers; as text and as JSON."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees
import textwrap
from typing import NamedTuple

from tf_tree_py.reports.plain_text import as_lines

from .pictures import Figure

_WIDTH = 96
# How many of a unit are in one of the SI, or in the whole.
_IN_ONE = {'mm': 1e3, 'cm': 100.0, 'ms': 1e3, 'deg': degrees(1.0), 'mrad': 1e3, 'kB': 1e-3,
           '%': 100.0}


class Column(NamedTuple):
    """
    One column of a table.

    :ivar key: its name in JSON; values there are in SI units.
    :ivar heading: its heading; the numbers below are in the unit at its end, such as ``[cm]``.
    :ivar style: the format of a number, such as ``.1f``.
    """

    key: str
    heading: str
    style: str = ''

    def write(self, value: object) -> str:
        """Return a value as text for the table; a dash for None."""
        if value is None:
            return '-'
        if isinstance(value, bool):
            return 'yes' if value else 'no'
        if not isinstance(value, (int, float)):
            return str(value)
        unit = self.heading.rpartition('[')[2].removesuffix(']')
        # Adding 0.0 turns a rounded -0.0 into 0.0.
        return format(round(value * _IN_ONE.get(unit, 1.0), 9) + 0.0 if self.style else value,
                      self.style)


@dataclass(frozen=True)
class Table:
    """Rows under headings, and a title."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[object]]

    def as_text(self) -> str:
        """Return the table as lines for a terminal: text is aligned left, numbers right."""
        cells = [[column.write(value) for column, value in zip(self.columns, row, strict=True)]
                 for row in self.rows]
        heads = [column.heading for column in self.columns]
        numbers = [number for number in range(len(heads))
                   if not any(isinstance(row[number], str) for row in self.rows)]
        return '\n'.join([self.title, *as_lines([heads, *cells], numbers, rule=True)])

    def as_dict(self) -> dict[str, object]:
        """Return the table for JSON: each row by the columns' keys."""
        keys = [column.key for column in self.columns]
        return {'title': self.title,
                'rows': [dict(zip(keys, row, strict=True)) for row in self.rows]}


@dataclass(frozen=True)
class Report:
    """
    The outcome of a lab.

    :ivar law: the law it shows, one sentence with the fitted numbers.
    :ivar remarks: further results, a paragraph each.
    :ivar numbers: the fitted numbers of the law, by name, for JSON; SI units.
    :ivar draw: draws the picture into a matplotlib ``Figure``.
    """

    tables: Sequence[Table]
    law: str
    remarks: Sequence[str] = ()
    numbers: Mapping[str, object] = field(default_factory=dict)
    draw: Callable[[Figure], None] | None = None

    def as_text(self) -> str:
        """Return the report for a terminal."""
        parts = [table.as_text() for table in self.tables]
        parts += [_wrapped(remark) for remark in self.remarks]
        return '\n\n'.join([*parts, _wrapped(f'The law: {self.law}')])

    def as_dict(self) -> dict[str, object]:
        """Return the report for JSON."""
        return {'law': self.law, 'numbers': dict(self.numbers), 'remarks': list(self.remarks),
                'tables': [table.as_dict() for table in self.tables]}


def _wrapped(text: str) -> str:
    """Wrap a paragraph; indented lines stay as they are."""
    lines = []
    for line in text.splitlines():
        lines += [line] if line.startswith(' ') else textwrap.wrap(line, _WIDTH)
    return '\n'.join(lines)
