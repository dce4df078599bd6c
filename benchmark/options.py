# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The options of ``scripts/bench``.

Uses the standard library only: ``scripts/bench --help`` runs this module with any Python, before
anything is installed.
"""

import argparse
from collections.abc import Sequence
import os
from pathlib import Path

from .report import are_whole_pages, PAGES

_WORKSPACE = Path(__file__).resolve().parent.parent / '.workspace'
_GROUPS = [group for groups in PAGES.values() for group in groups]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Return the options; print the help and exit, if that is requested."""
    parser = argparse.ArgumentParser(
        prog='scripts/bench', description='Measure tf_tree_py and its peers.',
        epilog='Before these options: --distro kilted, for another ROS 2; then --apt, to install '
               'the C++ peer, python3-tf2 of Debian, which needs root.')
    parser.add_argument('--quick', action='store_true',
                        help='fewer rounds, and a minute instead of an hour of traffic')
    parser.add_argument('--only', nargs='+', metavar='GROUP', choices=_GROUPS,
                        help=f'some of: {", ".join(_GROUPS)}')
    parser.add_argument('--out', type=Path, metavar='DIR', default=_default_folder(),
                        help='where results.json, summary.md and the plots go')
    parser.add_argument('--resume', action='store_true',
                        help='continue an interrupted run: keep the groups that DIR has, and '
                             'measure the others')
    parser.add_argument('--docs', action='store_true',
                        help='also put the results into docs/performance_*.md, the plots into '
                             'docs/images, and the figures into the text of all pages')
    parser.add_argument('--redraw', action='store_true',
                        help='measure nothing: renew the plots and the figures from the tables of '
                             'docs/performance_*.md')
    options = parser.parse_args(arguments)
    if options.docs and options.quick:
        parser.error('--docs is for full runs: not with --quick')
    if options.docs and options.only and not are_whole_pages(options.only):
        parser.error('--docs needs all groups of a page, or none of them')
    return options


def _default_folder() -> Path:
    return Path(os.environ.get('TF_TREE_PY_WORKSPACE', _WORKSPACE)) / 'benchmark'


if __name__ == '__main__':
    parse()
