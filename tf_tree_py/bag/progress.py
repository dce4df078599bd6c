"""A bar on the terminal while a bag is read; where there is no terminal, nothing."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress_bar(path: Path, total: int) -> Iterator[Callable[[int], None]]:
    """
    Show how much of a bag has been read.

    :param total: how many messages there are.
    :return: what to call with the number of messages that were just read.
    """
    bar = _bar() if sys.stderr.isatty() else None
    if bar is None:
        yield lambda _: None
        return
    with bar:
        task = bar.add_task(path.name, total=total)
        yield lambda read: bar.advance(task, read)


def _bar() -> 'Progress | None':
    try:
        from rich.console import Console
        from rich.progress import Progress
    except ImportError:  # no reason not to read
        return None
    return Progress(console=Console(stderr=True), transient=True)
