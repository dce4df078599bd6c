# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What tools give out: tables and coloured text with rich, JSON, and files."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
import json
import os
from pathlib import Path
import shutil
import sys
from typing import Any, NoReturn

from tf_tree_py.core.text import shorten

from .endings import needs

# Characters of a name or a line that a terminal gets, and of a sentence.
_LONGEST = 200
_LONGEST_SENTENCE = 1200
# The width of lines where no terminal says one.
_WIDTH = 100
# The least that is left of a table's last column.
_NARROWEST = 9

COLOURS = {'error': 'bold red', 'warning': 'yellow', 'note': 'cyan', 'fine': 'green'}


def console(**options: Any) -> Any:
    """
    Return a rich ``Console`` that writes to standard output.

    In a pipe it writes plain text, a hundred columns wide unless ``COLUMNS`` says another.

    :raises Cannot: rich is not installed.
    """
    rich = needs('rich.console', 'rich', 'tools')
    width = None if sys.stdout.isatty() or 'COLUMNS' in os.environ else _WIDTH
    made = rich.Console(highlight=False, width=width, soft_wrap=False, **options)
    made.on_broken_pipe = _leave  # rich would end the process, with the status 1
    return made


def _leave() -> NoReturn:
    """Tell that the reader of our output has left."""
    raise BrokenPipeError


def table(headings: Sequence[str], rows: Sequence[Sequence[Any]],
          right: Sequence[str] = ()) -> Any:
    """
    Return a rich ``Table`` of one line a row; the last column gives way where it is narrow.

    :param rows: of cells: text of strangers, which is not read as markup, or rich's ``Text``.
    :param right: the headings of the columns that end at the right, as numbers do.
    """
    box = needs('rich.box', 'rich', 'tools')
    text = needs('rich.text', 'rich', 'tools')
    made = needs('rich.table', 'rich', 'tools').Table(
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
    return needs('rich.text', 'rich', 'tools').Text(shown(text), style=COLOURS[what])


def fields(named: Mapping[str, str]) -> Any:
    """Return texts beside their names, indented, those that are empty left out."""
    text = needs('rich.text', 'rich', 'tools')
    grid = needs('rich.table', 'rich', 'tools').Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(min_width=7, justify='right', style='dim')
    grid.add_column()
    for name, value in named.items():
        if value:
            grid.add_row(name, text.Text(shown(value, _LONGEST_SENTENCE)))
    return grid


def shown(text: str, most: int = _LONGEST) -> str:
    """Return text of strangers for a terminal: short, and without what would steer it."""
    text = shorten(text, most)
    return ''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def fits(line: str) -> bool:
    """Return whether a line is no longer than the terminal is wide; in a pipe every one fits."""
    return not sys.stdout.isatty() or len(line) <= shutil.get_terminal_size().columns


def print_json(data: Any) -> None:
    """Print data as JSON, in lines that a person can read too."""
    print(json.dumps(data, indent=2, allow_nan=False))


def write_file(path: Path, data: bytes) -> None:
    """
    Write a file: all of it, or none; one that is there is replaced.

    :raises OSError: there is no place for it.
    """
    unfinished = path.with_name(f'.{path.name}.{os.getpid()}.unfinished')
    try:
        unfinished.write_bytes(data)
        unfinished.replace(path)
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def print_json_line(data: Any) -> None:
    """Print data as JSON in one line, at once: one of many answers that a program reads."""
    print(json.dumps(data, allow_nan=False), flush=True)
