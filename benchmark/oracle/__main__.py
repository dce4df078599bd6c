# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command line: ``python3 -m benchmark.oracle``, from a clone, with numpy and scipy.

Prints a table for the plane and one for space. The exit status is 1 if a number is not what it
must be.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import sys

from .robot import Wheels
from .tables import measured, put_into_page, settings_of, table

RATES_HZ = (1.0, 5.0, 30.0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    options = _parse(arguments)
    tables, good = [], True
    # Not forked: this process may have threads.
    with ProcessPoolExecutor(mp_context=get_context('spawn')) as pool:
        for planar in (True, False):
            settings = settings_of(planar, Wheels(options.scale, options.ground, options.short),
                                   options.rates)
            columns = measured(settings, options.seeds, pool.map)
            tables.append(table(settings, columns, options.seeds))
            print(f'{tables[-1]}\n', flush=True)
            good = good and all(row.good for rows in columns for row in rows)
    if options.docs:
        put_into_page('results', '\n'.join(tables))
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


if __name__ == '__main__':
    sys.exit(main())
