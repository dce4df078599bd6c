# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Format rows: as tables in the terminal, as Markdown, as JSON."""

from collections.abc import Collection, Iterable, Sequence
import json
from pathlib import Path
import re
from typing import Any

from .rows import Comparison, Row
from .timing import spread

Machine = dict[str, Any]

_TITLES = {
    'depth': 'One lookup by depth, with an insertion between two; 1 s of history unless stated',
    'history': 'One lookup in longer histories',
    'humanoid': 'The hand camera of the humanoid: 12 edges, 5 of them moving',
    'tree': 'All 38 frames of the humanoid relative to one',
    'many': 'Many stamps at depth 3, 10 s of history',
    'continuous': 'An edge on a spline: depth 3, its middle edge with 50 knots a second',
    'uncertain': 'Features beyond tf2: one lookup over 5 moving edges',
    'calibration': "Calibrating an edge and a time offset, compared with KinHEC's solvers",
    'control': 'A loop of 100 Hz that looks up while /tf arrives',
    'listener': 'CPU of a process that listens to /tf: transforms in a message x rate',
    'joints': 'CPU of a process that makes transforms of joint states',
    'doctor': 'CPU of a listener with a doctor: transforms in a message x rate',
    'wait': 'From an insertion until a blocked lookup returns',
    'shared': 'One tree for all processes: 38 transforms in a message at 500 Hz',
    'insert': 'Inserting one transform',
    'memory': 'Memory',
    'bag': 'Opening a bag: 38 edges in one message at 100 Hz, as MCAP',
    'fleet': 'CPU of a fleet listener: robots x frames that move x rate',
    'fleet_lag': 'From the publication of a robot until a lookup returns',
    'fleet_link': 'What a robot sends over Zenoh',
    'growth_samples': 'One lookup over five moving edges, by the samples of each edge',
    'growth_frames': 'One lookup, one insertion and all frames, by the frames of the tree',
    'growth_threads': 'Lookups by several threads on one buffer, depth 5',
    'growth_memory': 'Memory of a sample, by the samples of each edge',
    'growth_rates': 'A process that listens to /tf: messages of one transform, by their rate',
    'growth_bags': 'A folder of bags, each of one second and 3,800 transforms',
}

PAGES = {
    'performance_lookups.md': ('depth', 'history', 'humanoid', 'tree', 'many', 'continuous',
                               'insert'),
    'performance_nodes.md': ('listener', 'control', 'joints', 'doctor', 'wait'),
    'performance_shared.md': ('shared',),
    'performance_data.md': ('memory', 'bag', 'fleet', 'fleet_lag', 'fleet_link'),
    'performance_beyond.md': ('uncertain', 'calibration'),
    'performance_growth.md': ('growth_samples', 'growth_frames', 'growth_threads',
                              'growth_memory', 'growth_rates', 'growth_bags'),
}
"""The groups whose results each page of docs has."""


def pages_of(groups: Collection[str]) -> list[str]:
    """Return the pages that have some of these groups."""
    return [page for page, own in PAGES.items() if not set(own).isdisjoint(groups)]


def are_whole_pages(groups: Collection[str]) -> bool:
    """Return whether these are all groups of the pages that have some of them."""
    return all(set(PAGES[page]) <= set(groups) for page in pages_of(groups))


BEGIN, END = '<!-- results: begin -->', '<!-- results: end -->'
"""The results of a page are between these comments."""


def group_of(title: str) -> str | None:
    """Return the group whose table has this title."""
    return next((group for group, known in _TITLES.items() if known == title), None)


def group_tables(rows: Sequence[Row]) -> Iterable[str]:
    """Yield a table of the measurements of each group."""
    for group in dict.fromkeys(row.group for row in rows):
        yield group_table([row for row in rows if row.group == group])


def group_table(rows: Sequence[Row]) -> str:
    """Return the measurements of one group: median (least to greatest) of each contestant."""
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    lines = [[row.name, row.unit,
              *(_cell(row.values[name]) if name in row.values else '' for name in names)]
             for row in rows]
    title = _TITLES.get(rows[0].group, rows[0].group)
    return f'### {title}\n\n' + _table(['', 'unit', *names], lines)


def comparison_table(rows: Sequence[Row]) -> str:
    """Return all comparisons with their targets."""
    lines = [[row.group, comparison.name,
              f'{_number(comparison.spread.median)} {comparison.unit}'.strip(),
              f'{_number(comparison.spread.least)} to {_number(comparison.spread.greatest)}',
              '' if comparison.target is None else f'≤ {_number(comparison.target)}',
              _verdict(comparison)]
             for row in rows for comparison in row.comparisons]
    return _table(['group', '', 'median', 'rounds', 'target', ''], lines)


def machine_lines(machine: Machine, absent: dict[str, str]) -> str:
    """Return the description of the machine, and the absent contestants."""
    packages = ', '.join(f'{name} {machine[name]}' for name in (
        'python', 'numpy', 'scipy', 'rclpy', 'rmw', 'transform-tree', 'pytransform3d')
        if machine[name])
    load = '; '.join(
        f'{name} ' + ', '.join(f'{value:.2f}' for value in machine[f'load_{name}'])
        for name in ('before', 'after') if f'load_{name}' in machine)
    lines = [f'{machine["cpu"]}, {machine["cores"]} cores', f'load average {load}',
             packages,
             machine['date'] + (f', commit {machine["commit"]}' if machine['commit'] else '')]
    lines += [f'absent: {name}: {reason}' for name, reason in absent.items()]
    return '\n'.join(f'- {line}' for line in lines)


def summary(rows: Sequence[Row], machine: Machine, absent: dict[str, str]) -> str:
    """Return all results as Markdown."""
    parts = [machine_lines(machine, absent), '### Ratios and targets', comparison_table(rows),
             *group_tables(rows)]
    return '\n\n'.join(parts) + '\n'


def write(folder: Path, rows: Sequence[Row], machine: Machine, absent: dict[str, str]) -> None:
    """Write ``results.json`` and ``summary.md``."""
    folder.mkdir(parents=True, exist_ok=True)
    results = {'machine': machine, 'absent': absent, 'rows': [row.as_dict() for row in rows]}
    (folder / 'results.json').write_text(json.dumps(results, indent=1) + '\n')
    (folder / 'summary.md').write_text(summary(rows, machine, absent))


def read(folder: Path) -> tuple[list[Row], Machine, dict[str, str]]:
    """
    Return the rows, the machine and the absent contestants of a run; see ``write``.

    :raises OSError: there is none in the folder.
    :raises ValueError: it was interrupted while it was written.
    """
    results = json.loads((folder / 'results.json').read_text())
    return list(map(Row.from_dict, results['rows'])), results['machine'], results['absent']


def update_pages(docs: Path, rows: Sequence[Row], machine: Machine,
                 absent: dict[str, str]) -> None:
    """Replace the results on each page that has groups of a run."""
    for page in pages_of({row.group for row in rows}):
        own = [row for row in rows if row.group in PAGES[page]]
        _update(docs / page, summary(own, machine, absent))


def _update(document: Path, text: str) -> None:
    found = re.compile(f'{re.escape(BEGIN)}.*{re.escape(END)}', re.DOTALL)
    replaced, count = found.subn(
        lambda _: f'{BEGIN}\n\n{text}\n{END}', document.read_text())
    if count != 1:
        raise ValueError(f'{document} has no place for the results: {BEGIN} ... {END}')
    document.write_text(replaced)


def _verdict(comparison: Comparison) -> str:
    return {None: '', True: 'met', False: '**missed**'}[comparison.met]


def _cell(values: Sequence[float]) -> str:
    least, median, greatest = spread(values)
    if least == greatest:
        return _number(median)
    return f'{_number(median)} ({_number(least)} to {_number(greatest)})'


def _number(value: float) -> str:
    """Format a number with three digits, or with all digits before the point."""
    return f'{value:.0f}' if abs(value) >= 100.0 else f'{value:.3g}'


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table that is also readable as plain text."""
    widths = [max(map(len, column)) for column in zip(head, *lines, strict=True)]
    rule = ['-' * max(3, width) for width in widths]
    return '\n'.join(
        '| ' + ' | '.join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        + ' |' for line in [head, rule, *lines])
