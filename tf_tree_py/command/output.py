# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Output of programs: tables and coloured text with rich, and JSON."""

from collections.abc import Mapping, Sequence
import json
import os
import shutil
import sys
from typing import Any, NoReturn

from .endings import needs

# The most characters of a name or a line, and of a sentence, that are printed.
_LONGEST = 200
_LONGEST_SENTENCE = 1200
# The width of lines if the output is not a terminal.
_WIDTH = 100
# The least width of the last column of a table.
_NARROWEST = 9

COLOURS = {'error': 'bold red', 'warning': 'yellow', 'note': 'cyan', 'fine': 'green'}


def console(**options: Any) -> Any:
    """
    Return a rich ``Console`` that writes to standard output.

    In a pipe it writes plain text, 100 columns wide unless ``COLUMNS`` sets another width.

    :raises Cannot: rich is not installed.
    """
    rich = needs('rich.console', 'rich')
    width = None if sys.stdout.isatty() or 'COLUMNS' in os.environ else _WIDTH
    made = rich.Console(highlight=False, width=width, soft_wrap=False, **options)
    made.on_broken_pipe = _leave  # rich would end the process, with the status 1
    return made


def _leave() -> NoReturn:
    """Report that the reader of the output has closed it."""
    raise BrokenPipeError


def table(headings: Sequence[str], rows: Sequence[Sequence[Any]],
          right: Sequence[str] = ()) -> Any:
    """
    Return a rich ``Table`` with one line per row; the last column is shortened to fit.

    :param rows: cells: untrusted text, which is not parsed as markup, or rich's ``Text``.
    :param right: the headings of right-aligned columns, such as numbers.
    """
    box = needs('rich.box', 'rich')
    text = needs('rich.text', 'rich')
    made = needs('rich.table', 'rich').Table(
        box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, padding=(0, 1, 0, 0))
    for heading in headings:
        is_last = heading == headings[-1]
        made.add_column(heading, justify='right' if heading in right else 'left',
                        no_wrap=not is_last, min_width=_NARROWEST if is_last else None,
                        overflow='ellipsis')
    for row in rows:
        made.add_row(*(text.Text(shown(cell)) if isinstance(cell, str) else cell for cell in row))
    return made


def styled(text: str, what: str) -> Any:
    """Return rich's ``Text`` in a colour of ``COLOURS``."""
    return needs('rich.text', 'rich').Text(shown(text), style=COLOURS[what])


def fields(named: Mapping[str, str]) -> Any:
    """Return texts beside their names, indented; empty texts are omitted."""
    text = needs('rich.text', 'rich')
    grid = needs('rich.table', 'rich').Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(min_width=7, justify='right', style='dim')
    grid.add_column()
    for name, value in named.items():
        if value:
            grid.add_row(name, text.Text(shown(value, _LONGEST_SENTENCE)))
    return grid


def shown(text: str, most: int = _LONGEST) -> str:
    """Return untrusted text, shortened in its middle, with control characters escaped."""
    if len(text) > most:
        text = f'{text[:most // 2]} ... {text[-(most // 2):]}'
    return ''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def fits(line: str) -> bool:
    """Return whether a line fits the width of the terminal; in a pipe every line fits."""
    return not sys.stdout.isatty() or len(line) <= shutil.get_terminal_size().columns


def print_json(data: Any) -> None:
    """Print data as indented JSON."""
    print(json.dumps(data, indent=2, allow_nan=False))


def print_json_line(data: Any) -> None:
    """Print data as one line of JSON, and flush it: one record of a stream."""
    print(json.dumps(data, allow_nan=False), flush=True)
