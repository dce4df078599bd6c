# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The benchmark's command line: ``python -m benchmark``, in ``scripts/bench``'s environment.

Prints the table of each group of rows when the group is complete, and at the end every ratio
with its target; writes JSON, Markdown and plots.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
import os
from pathlib import Path
import sys

from tf_tree_py.labs.tf_lab import progress

from . import machine, plots, report
from .effort import Effort, FULL, QUICK
from .groups import (
    calibrating,
    continuous,
    control,
    fleets,
    inserting,
    joints,
    listening,
    lookups,
    many,
    memory,
    recordings,
    uncertain,
    waiting,
)
from .peers.finding import Contestants
from .rows import Row

_REPOSITORY = Path(__file__).resolve().parent.parent
_DOCS = _REPOSITORY / 'docs'
_IMAGES = _DOCS / 'images'

GROUPS: dict[str, Callable[[Contestants, Effort], Iterator[Row]]] = {
    'depth': lookups.depths,
    'history': lookups.histories,
    'humanoid': lookups.humanoid,
    'tree': lookups.whole_tree,
    'many': many.many,
    'continuous': continuous.continuous,
    'uncertain': uncertain.uncertain,
    'calibration': calibrating.calibration,
    'listener': listening.listening,
    'control': control.control,
    'joints': joints.joints,
    'doctor': listening.watching,
    'wait': waiting.waiting,
    'insert': inserting.inserting,
    'memory': memory.memory,
    'bag': recordings.recordings,
    'fleet': fleets.listening,
    'fleet_lag': fleets.lag,
    'fleet_link': fleets.link,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the requested measurements."""
    options = _parse(arguments)
    if options.redraw:
        _draw(_IMAGES, report.rows_of(_DOCS))
        return
    effort = QUICK if options.quick else FULL
    measured_on = machine.describe()
    rows: list[Row] = []
    with Contestants() as contestants:
        print(report.machine_lines(measured_on, contestants.absent), flush=True)
        for name in options.only or GROUPS:
            _say(f'measuring: {name}')
            with progress(f'benchmark: {name}'):
                found = list(GROUPS[name](contestants, effort))
            rows += found
            print(f'\n{report.group_table(found)}', flush=True)
        absent = contestants.absent
    measured_on['load_after'] = machine.load()
    print(f'\n{report.comparison_table(rows)}')
    report.write(options.out, rows, measured_on, absent)
    _draw(options.out, rows)
    if options.docs:
        report.update_pages(_DOCS, rows, measured_on, absent)
        _draw(_IMAGES, rows)
    _say(f'written to {options.out}')


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='scripts/bench', description='Measure tf_tree_py and its peers.')
    parser.add_argument('--quick', action='store_true',
                        help='fewer rounds, and a minute instead of an hour of traffic')
    parser.add_argument('--only', nargs='+', metavar='GROUP', choices=GROUPS,
                        help=f'some of: {", ".join(GROUPS)}')
    parser.add_argument('--out', type=Path, metavar='DIR', default=_default_folder(),
                        help='where results.json, summary.md and the plots go')
    parser.add_argument('--docs', action='store_true',
                        help='also put results and plots into the pages docs/performance_*.md')
    parser.add_argument('--redraw', action='store_true',
                        help='measure nothing: draw the plots of these pages from their tables')
    options = parser.parse_args(arguments)
    if options.docs and (options.quick or options.only):
        parser.error('--docs is for full runs: not with --quick or --only')
    return options


def _default_folder() -> Path:
    workspace = os.environ.get('TF_TREE_PY_WORKSPACE', _REPOSITORY / '.workspace')
    return Path(workspace) / 'benchmark'


def _draw(folder: Path, rows: Sequence[Row]) -> None:
    try:
        plots.draw(folder, rows)
    except ImportError as error:
        _say(f'no plots: {error} (sudo apt install python3-matplotlib)')


def _say(text: str) -> None:
    print(f'benchmark: {text}', file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
