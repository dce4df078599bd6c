# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Write a run into the documentation: tables, plots, and the figures in the text."""

from collections.abc import Mapping, Sequence
from pathlib import Path
import sys

from . import figures, plots, report, stored
from .passages import PASSAGES
from .rows import Row


def refuse_absent(absent: Mapping[str, str]) -> None:
    """
    Check, before a run, that all contestants that a passage quotes are here.

    :param absent: the other contestants, and why they are unavailable.
    :raises SystemExit: one of them is quoted.
    """
    quoted = figures.quoted(PASSAGES, absent)
    if quoted:
        raise SystemExit('benchmark: --docs needs what the pages quote: ' + '; '.join(
            f'{name} ({reason})' for name, reason in quoted.items()))


def publish(repository: Path, rows: Sequence[Row], machine: report.Machine,
            absent: dict[str, str]) -> None:
    """
    Write a run into the pages.

    :raises SystemExit: the pages quote what was not measured; they stay as they are.
    """
    missing = figures.missing(
        PASSAGES, stored.after_run(repository / 'docs', rows, machine))
    if missing:
        raise SystemExit('benchmark: the pages stay as they are, because they quote what was not '
                         f'measured: {"; ".join(missing)}')
    report.update_pages(repository / 'docs', rows, machine, absent)
    renew(repository)


def renew(repository: Path) -> None:
    """Write the figures in the text of all pages, and draw the plots, from the tables."""
    results = stored.results_of(repository / 'docs')
    figures.renew(repository, PASSAGES, results)
    draw(repository / 'docs' / 'images', results.rows)


def draw(folder: Path, rows: Sequence[Row]) -> None:
    """Draw all plots; print a line instead if matplotlib is not installed."""
    try:
        plots.draw(folder, rows)
    except ImportError as error:
        say(f'no plots: {error} (sudo apt install python3-matplotlib)')


def say(text: str) -> None:
    """Print a message for the user."""
    print(f'benchmark: {text}', file=sys.stderr, flush=True)
