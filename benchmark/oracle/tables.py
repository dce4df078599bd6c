# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Drives of all seeds and settings, and their tables in Markdown."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from .drive import AGREEING, DRIVE, drive, JUMPING, Record, Setting
from .judge import Drives, Row, rows_of
from .robot import drift_by_way, Wheels

_PAGE = Path(__file__).parents[2] / 'docs' / 'oracle.md'

# The record of each story and setting.
Seed = list[list[Record]]
Map = Callable[[Callable[[int], Seed], Iterable[int]], Iterable[Seed]]


def settings_of(planar: bool, wheels: Wheels, rates_hz: Sequence[float]) -> list[Setting]:
    """Return the settings for some rates of the localiser."""
    drift = drift_by_way(planar, wheels)
    return [Setting(planar, rate, wheels, drift) for rate in rates_hz]


def measured(settings: Sequence[Setting], seeds: int, mapped: Map = map) -> list[list[Row]]:
    """
    Return the rows of each setting.

    :param mapped: ``map``, or that of a pool of processes.
    """
    found = list(mapped(partial(_driven, settings), range(seeds)))
    return [rows_of(Drives(*([one[story][number] for one in found]
                             for story in range(len(Drives._fields)))))
            for number in range(len(settings))]


def _driven(settings: Sequence[Setting], seed: int) -> Seed:
    """Return the records of all stories; each robot drives the same for all settings."""
    return [[drive(setting, story, seed) for setting in settings]
            for story in (DRIVE, AGREEING, JUMPING)]


def table(settings: Sequence[Setting], columns: Sequence[Sequence[Row]], seeds: int) -> str:
    """Return the rows as a table of Markdown, with a column for each rate."""
    title, drift = 'In the plane' if settings[0].planar else 'In space', settings[0].drift
    lines = [f'### {title}', '',
             f'{seeds} drives of each kind; drift by way: {drift[0]:.3f} m and {drift[1]:.3f} rad '
             'per square root of a metre.', '',
             f'| | {" | ".join(f"{each.rate_hz:g} Hz" for each in settings)} | must be |',
             f'| --- |{" --- |" * (len(settings) + 1)}']
    for rows in zip(*columns, strict=True):
        cells = [row.value if row.good else f'**{row.value}**' for row in rows]
        must = '; '.join(dict.fromkeys(row.must for row in rows))
        lines.append(f'| {rows[0].name} | {" | ".join(cells)} | {must} |')
    return '\n'.join(lines) + '\n'


def put_into_page(name: str, tables: str) -> None:
    """Put tables between the comments in docs/oracle.md that mark the begin and end of a part."""
    begin, end = (f'<!-- {name}: {which} -->\n' for which in ('begin', 'end'))
    before, _, rest = _PAGE.read_text().partition(begin)
    _PAGE.write_text(''.join([before, begin, '\n', tables, '\n', end, rest.partition(end)[2]]))
