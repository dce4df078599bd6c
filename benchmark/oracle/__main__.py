# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command line: ``python3 -m benchmark.oracle``, from a clone, with numpy and scipy.

Prints a table for the plane and one for space. The exit status is 1 if a number is not what it
must be.
"""

import argparse
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
import sys

from .drive import AGREEING, DRIVE, drive, JUMPING, Record, Setting
from .judge import Drives, Row, rows_of
from .robot import drift_by_way, Wheels

RATES_HZ = (1.0, 5.0, 30.0)
_PAGE = Path(__file__).parents[2] / 'docs' / 'oracle.md'
_BEGIN, _END = '<!-- results: begin -->\n', '<!-- results: end -->\n'

# The record of each story and setting.
Seed = list[list[Record]]
Map = Callable[[Callable[[int], Seed], Iterable[int]], Iterable[Seed]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    options = _parse(arguments)
    tables, good = [], True
    for planar in (True, False):
        # Not forked: this process may have threads.
        with ProcessPoolExecutor(mp_context=get_context('spawn')) as pool:
            settings = settings_of(planar, Wheels(options.scale, options.ground, options.short),
                                   options.rates)
            columns = measured(settings, options.seeds, pool.map)
        tables.append(table(settings, columns, options.seeds))
        print(f'{tables[-1]}\n', flush=True)
        good = good and all(row.good for rows in columns for row in rows)
    if options.docs:
        before, _, rest = _PAGE.read_text().partition(_BEGIN)
        parts = [before, _BEGIN, '\n', '\n'.join(tables), '\n', _END, rest.partition(_END)[2]]
        _PAGE.write_text(''.join(parts))
    return 0 if good else 1


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='python3 -m benchmark.oracle',
        description='Let a simulated robot judge the anchor and lookup_uncertain.')
    usual = Wheels()
    parser.add_argument('--seeds', type=int, default=50, help='how many drives of each kind')
    parser.add_argument('--rates', type=float, nargs='+', default=RATES_HZ, metavar='HZ',
                        help='how often the localiser sees the robot')
    parser.add_argument('--scale', type=float, default=usual.scale, help='the standard deviation '
                        "of the odometry's constant scale error: 0.005 for 0.5 %%")
    parser.add_argument('--ground', type=float, default=usual.ground, metavar='METRES',
                        help="the correlation length of a wheel's slip")
    parser.add_argument('--short', type=float, default=usual.short, metavar='METRES',
                        help='the standard deviation of a short slip, once in ten metres')
    parser.add_argument('--docs', action='store_true',
                        help='also put the tables into docs/oracle.md')
    options = parser.parse_args(arguments)
    if options.seeds < 2:
        parser.error('--seeds must be at least 2: one drive has no spread')
    return options


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


if __name__ == '__main__':
    sys.exit(main())
