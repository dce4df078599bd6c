# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_archive``: the doctor's report about thousands of bags, or an export."""

from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec
import os
from pathlib import Path
import sys
from typing import Any

from tf_tree_py.bag.opening import progress_bar
from tf_tree_py.command import signals
from tf_tree_py.command.arguments import (
    console,
    Parser,
    positive_integer,
    print_json,
    styled,
    table,
)
from tf_tree_py.command.endings import cannot_be, entry_point, FINE, FOUND, needs
from tf_tree_py.files.whole_files import write_whole

from .archive.jobs import BagPath, bags_in, exported, Job, Ledger, reported, Row
from .archive.page import index_page
from .archive.running import client_of, results
from .archive.table import as_csv, as_data, as_json, by_trouble, columns_of, summary
from .doctor_report import add_limits, limits_of
from .export.formats import FORMATS
from .export.plan import add_frames, add_plan, planned

NAME = 'tf_archive'

_DESCRIPTION = """\
Reads many bags in parallel, in local processes or on a dask cluster. `report` runs the
doctor on each bag, and `export` writes a trajectory from each. `tf_archive report --help`
lists the options. Each bag is one task, so a broken bag affects only its own row. Each
result is written to disk immediately. To resume an interrupted run, repeat the command.

The exit status is 0 if all is well, 1 if a bag is broken or has an error, 2 if nothing
could be done."""

_EXAMPLES = (
    ("tf_archive report 'runs/**/*.mcap' -o report", 'then open report/index.html'),
    ("tf_archive export map camera 'runs/*' --at /camera/image_raw", 'a trajectory from each'),
    ("tf_archive report 's3://runs/*' --scheduler tcp://host:8786", 'on a cluster'),
)


def _report_parser() -> Parser:
    parser = Parser(f'{NAME} report', 'Runs the doctor on many bags.', _EXAMPLES[::2])
    _add_common(parser, 'archive_report')
    add_limits(parser)
    return parser


def _export_parser() -> Parser:
    parser = Parser(f'{NAME} export', 'Writes a trajectory from each of many bags.',
                    _EXAMPLES[1:2])
    add_frames(parser)
    _add_common(parser, 'archive_export')
    add_plan(parser)
    parser.add_argument('--format', choices=[*FORMATS], default='tum')
    return parser


def _add_common(parser: Parser, folder: str) -> None:
    parser.add_argument('bags', metavar='GLOB', nargs='+', help='bags: files and folders, '
                        'quoted patterns, and any URL that fsspec opens')
    parser.add_argument('-o', '--output', metavar='FOLDER', type=Path, default=Path(folder),
                        help=f'the folder for the results (default {folder})')
    parser.add_argument('--again', action='store_true',
                        help='read bags again that were read before')
    parser.add_argument('--workers', metavar='N', type=positive_integer,
                        default=os.cpu_count() or 1, help='processes on this machine '
                        '(default: one for each processor)')
    parser.add_argument('--scheduler', metavar='ADDRESS',
                        help='the dask cluster to run on, such as tcp://host:8786')
    parser.add_json()


_VERBS = {'report': _report_parser, 'export': _export_parser}


def _parsed(argv: Sequence[str]) -> Namespace:
    if argv and argv[0] in _VERBS:
        arguments = _VERBS[argv[0]]().parse(argv[1:])
        arguments.verb = argv[0]
        return arguments
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('verb', choices=[*_VERBS], help='what to do with the bags')
    return parser.parse(argv[:1])


def _job(arguments: Namespace) -> Job:
    if arguments.verb == 'report':
        return partial(reported, limits_of(arguments))
    return partial(exported, planned(arguments), arguments.format)


def _work(argv: Sequence[str]) -> int:
    arguments = _parsed(argv)
    job = _job(arguments)
    signals.raise_interrupts()
    bags = bags_in(arguments.bags)
    ledger = Ledger(arguments.output, job)
    known = {} if arguments.again else {
        bag: row for bag in bags if (row := ledger.finished(bag)) is not None}
    rows = [*known.values(), *_read(arguments, job, ledger, [
        bag for bag in bags if bag not in known])]
    rows = by_trouble(rows)
    _write(arguments, rows)
    _tell(arguments, rows, len(known))
    return FOUND if {'lost', 'broken', 'error'} & {row['outcome'] for row in rows} else FINE


def _read(arguments: Namespace, job: Job, ledger: Ledger, bags: Sequence[BagPath]) -> list[Row]:
    rows: list[Row] = []
    if not bags:
        return rows
    workers = min(arguments.workers, len(bags))
    try:
        with client_of(arguments.scheduler, workers) as client, \
                progress_bar('bags', len(bags)) as tell:
            _tell_of(client)
            for bag, result in results(client, job, bags):
                rows.append(ledger.keep(bag, result))
                tell(1)
    except KeyboardInterrupt:
        print(f'{NAME}: {len(rows)} of {len(bags)} bags are done; repeat the command to read '
              'the others', file=sys.stderr)
        raise
    return rows


def _tell_of(client: Any) -> None:
    """Print the address of the dashboard, and whether workers are missing, on standard error."""
    if sys.stderr.isatty() and find_spec('bokeh'):
        print(f'{NAME}: the dask dashboard is at {client.dashboard_link}', file=sys.stderr)
    if not client.nthreads():
        print(f'{NAME}: {client.scheduler.address} has no workers yet; waiting for one',
              file=sys.stderr)


def _write(arguments: Namespace, rows: Sequence[Row]) -> None:
    title = f'{NAME} {arguments.verb}'
    page = index_page(title, rows, [name for name in columns_of(rows) if name != 'file'],
                      summary(rows))
    with cannot_be('written', arguments.output):
        for name, data in (('table.csv', as_csv(rows)), ('table.json', as_json(rows)),
                           ('index.html', page)):
            write_whole(arguments.output / name, [data])


def _tell(arguments: Namespace, rows: Sequence[Row], known: int) -> None:
    if arguments.json:
        print_json(as_data(rows))
        return
    out = console()
    worst = [row for row in rows if row['outcome'] != 'fine'][:20]
    if worst:
        out.print(table(('bag', 'outcome', 'why'), [
            (row['bag'], row['outcome'], row['reason'] or row.get('codes', ''))
            for row in worst]))
    text = needs('rich.text', 'rich')
    counts = summary(rows)
    out.print(text.Text(f'{len(rows)} bag{"s" * (len(rows) != 1)}: '
                        + ', '.join(f'{count} {name}' for name, count in counts.items())
                        + (f'; {known} had been read before' if known else '')))
    out.print(styled(str(arguments.output / 'index.html'), 'fine'))


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
