# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A line about the progress on stderr, if the work takes longer than two seconds."""

from collections.abc import Iterator
from contextlib import contextmanager
import sys
import threading
import time

PATIENCE_S = 2.0
"""How long nothing is printed."""

_TERMINAL_S, _LOG_S = 1.0, 20.0


@contextmanager
def progress(what: str) -> Iterator[None]:
    """
    Print the current work and its duration to stderr; not in the first 2 s.

    On a terminal one line counts the seconds, and is erased at the end. In a log a line is
    written periodically.

    :param what: such as ``tf_lab: latency, between processes``.
    """
    done = threading.Event()
    printer = threading.Thread(
        target=_print_duration, args=(what, done), name='progress', daemon=True)
    printer.start()
    try:
        yield
    finally:
        done.set()
        printer.join()


def _print_duration(what: str, done: threading.Event) -> None:
    terminal = sys.stderr.isatty()
    begin = time.monotonic()
    pause = PATIENCE_S
    while not done.wait(pause):
        line = f'{what}: {time.monotonic() - begin:.0f} s so far, Ctrl-C ends it'
        print(f'\r{line}' if terminal else line, end='' if terminal else '\n', file=sys.stderr,
              flush=True)
        pause = _TERMINAL_S if terminal else _LOG_S
    if terminal and pause != PATIENCE_S:
        print('\r\x1b[K', end='', file=sys.stderr, flush=True)
