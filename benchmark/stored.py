# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read results back from the tables that ``report`` wrote into the pages."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import datetime
from fnmatch import fnmatchcase
from pathlib import Path
import re
from typing import Any, NamedTuple

from .report import BEGIN, END, group_of, PAGES, pages_of
from .rows import Comparison, Row
from .timing import Spread, spread

_NO_COMMIT = 'unknown'


class Run(NamedTuple):
    """
    The run whose results a page has.

    :ivar date: such as '21 November 2026'.
    :ivar commit: the short hash of the commit that was measured.
    """

    date: str
    commit: str


class Results(NamedTuple):
    """
    The results on all pages.

    :ivar rows: with the least, the median and the greatest of each contestant.
    :ivar ratios: the table of ratios and targets of each page, with the groups of its lines.
    :ivar runs: by page.
    """

    rows: list[Row]
    ratios: list[tuple[str, Comparison]]
    runs: dict[str, Run]

    def measured(self, group: str, name: str, contestant: str, unit: str = '*') -> Spread:
        """
        Return a measurement; a ``*`` in the name stands for any text.

        :raises KeyError: it was not measured.
        """
        for row in self.rows:
            if (row.group == group and contestant in row.values
                    and fnmatchcase(row.name, name) and fnmatchcase(row.unit, unit)):
                return spread(row.values[contestant])
        raise KeyError(f'{contestant} in {group}: {name}')

    def ratio(self, group: str, name: str, unit: str) -> Spread:
        """
        Return a number of the table of ratios.

        :raises KeyError: it was not measured.
        """
        for of_group, comparison in self.ratios:
            if (of_group, comparison.name, comparison.unit) == (group, name, unit):
                return comparison.spread
        raise KeyError(f'{unit} in {group}: {name}')


def results_of(docs: Path, pages: Collection[str] = PAGES) -> Results:
    """
    Return the results on all pages, or on some of them.

    :raises ValueError: a page contains no results.
    """
    tables = {page: _results(docs / page) for page in pages}
    return Results(
        [row for page in pages for row in _rows(docs / page, tables[page])],
        [ratio for page in pages for ratio in _ratios(tables[page])],
        {page: _run(docs / page, tables[page]) for page in pages})


def of_run(rows: Sequence[Row], machine: Mapping[str, Any]) -> Results:
    """Return the results of a run that is not on the pages yet."""
    run = Run(_day(machine['date']), machine['commit'] or _NO_COMMIT)
    return Results(list(rows), [(row.group, comparison) for row in rows
                                for comparison in row.comparisons],
                   dict.fromkeys(pages_of({row.group for row in rows}), run))


def after_run(docs: Path, rows: Sequence[Row], machine: Mapping[str, Any]) -> Results:
    """Return the results that all pages will have after a run, which may be one of some pages."""
    run = of_run(rows, machine)
    others = results_of(docs, [page for page in PAGES if page not in run.runs])
    return Results(run.rows + others.rows, run.ratios + others.ratios, others.runs | run.runs)


def _results(document: Path) -> str:
    _, found, results = document.read_text().partition(BEGIN)
    if not found:
        raise ValueError(f'{document} has no results: {BEGIN} ... {END}')
    return results.partition(END)[0]


def _rows(document: Path, results: str) -> list[Row]:
    rows = []
    for part in results.split('\n### ')[1:]:
        title, *lines = part.splitlines()
        group = group_of(title)
        if group is not None:
            head, *body = _cells(lines)
            rows += [Row(group, name, unit, {
                contestant: _numbers(cell)
                for contestant, cell in zip(head[2:], cells, strict=True) if cell})
                for name, unit, *cells in body]
    if not rows:
        raise ValueError(f'{document} has no results: {BEGIN} ... {END}')
    return rows


def _ratios(results: str) -> Iterator[tuple[str, Comparison]]:
    """Yield the table before those of the groups."""
    first = results.split('\n### ')[1]
    for group, name, median, rounds, target, _ in _cells(first.splitlines())[1:]:
        number, _, unit = median.partition(' ')
        least, greatest = _numbers(rounds)
        yield group, Comparison(name, Spread(least, float(number), greatest), unit,
                                _numbers(target)[0] if target else None)


def _run(document: Path, results: str) -> Run:
    found = re.search(r'^- (\d{4}-\d\d-\d\dT[^\s,]+)(?:, commit (\w+))?', results, re.MULTILINE)
    if found is None:
        raise ValueError(f'{document} does not say when its results were measured')
    return Run(_day(found[1]), found[2] or _NO_COMMIT)


def _day(stamp: str) -> str:
    date = datetime.fromisoformat(stamp)
    return f'{date.day} {date:%B %Y}'


def _cells(lines: list[str]) -> list[list[str]]:
    """Return the cells of a table: its head, and its lines."""
    head, _, *body = [[cell.strip() for cell in line.strip('|').split('|')]
                      for line in lines if line.startswith('|')]
    return [head, *body]


def _numbers(cell: str) -> list[float]:
    """Parse the numbers of a cell of ``report``: the median before its ends."""
    return [float(number) for number in re.findall(r'[\d.]+(?:e[+-]\d+)?', cell)]
