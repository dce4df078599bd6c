# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Show a progress bar on the terminal while bags are read."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import multiprocessing
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """
    Show how much of a bag, or how many bags, have been read.

    :param total: how many messages, or bags, there are.
    :return: a function to call with the number of messages or bags just read.
    """
    # A worker shares the terminal of its parent process, which shows the bar.
    alone = multiprocessing.parent_process() is None
    bar = _bar() if alone and sys.stderr.isatty() else None
    if bar is None:
        yield lambda _: None
        return
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda read: bar.advance(task, read)


def _bar() -> 'Progress | None':
    try:
        from rich.console import Console
        from rich.progress import Progress
    except ImportError:  # the bar is optional
        return None
    return Progress(console=Console(stderr=True), transient=True)
