"""What tools print: tables and coloured text with rich, and JSON."""

from collections.abc import Callable, Sequence
import json
import os
import sys
from typing import Any

from .endings import needs

# The width of lines where no terminal says one.
_WIDTH = 100

COLOURS = {'error': 'bold red', 'warning': 'yellow', 'note': 'cyan', 'fine': 'green'}


def console(**options: Any) -> Any:
    """
    Return a rich ``Console`` that writes to standard output.

    In a pipe it writes plain text, a hundred columns wide unless ``COLUMNS`` says another.

    :raises Cannot: rich is not installed.
    """
    rich = needs('rich.console', 'rich', 'tools')
    width = None if sys.stdout.isatty() or 'COLUMNS' in os.environ else _WIDTH
    return rich.Console(highlight=False, width=width, soft_wrap=False, **options)


def table(headings: Sequence[str], rows: Sequence[Sequence[Any]],
          right: Sequence[str] = ()) -> Any:
    """
    Return a rich ``Table``.

    :param rows: of cells: text of strangers, which is not read as markup, or rich's ``Text``.
    :param right: the headings of the columns that end at the right, as numbers do.
    """
    box = needs('rich.box', 'rich', 'tools')
    text = needs('rich.text', 'rich', 'tools')
    made = needs('rich.table', 'rich', 'tools').Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        made.add_column(heading, justify='right' if heading in right else 'left')
    for row in rows:
        made.add_row(*(text.Text(cell) if isinstance(cell, str) else cell for cell in row))
    return made


def print_json(data: Any, write: Callable[[str], Any] = print) -> None:
    """Print data as JSON, in lines that a person can read too."""
    write(json.dumps(data, indent=2, allow_nan=False))
