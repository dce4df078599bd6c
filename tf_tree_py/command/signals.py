# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Handlers of SIGINT and SIGTERM for the three phases of a process.

Both signals have the same effect. While a process starts, they end it at once. While it works,
they raise an exception or call a function. While it ends, they have no effect.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import ctypes
from functools import cache
import math
import os
import select
import signal
import threading
import time

_NUMBERS = (signal.SIGINT, signal.SIGTERM)
# A signal raises an exception only if none was raised during this time: of two signals in a row,
# the second would interrupt the clean-up after the first.
_PAUSE_S = 1.0
# When signals raised an exception since ``raise_interrupts``, or were deferred, by the monotonic
# clock.
_raised: list[float] = []
_is_deferring = False

over = False
"""
Whether signals no longer raise exceptions. It is set before ``ignore`` is called: Python may
handle a signal at the start of any function, but not between two assignments.
"""


def end_at_once(status: int) -> None:
    """
    From now on, let a signal end the process with a status, without clean-up.

    Use it while a program only imports modules. An exception could be lost there: libraries
    catch what an import raises, and Python ignores exceptions in finalizers.
    """
    _handle(lambda *_: os._exit(status))


def raise_interrupts() -> None:
    """
    From now on, let a signal raise ``KeyboardInterrupt`` in the main thread.

    It raises no second one for a second. After that it does, so Ctrl-C also ends a clean-up that
    hangs, or a program in which the exception was lost.
    """
    global over
    over = False
    _raised.clear()
    _handle(_interrupt)


def _interrupt(*_: object) -> None:
    now = time.monotonic()
    if not over and (not _raised or now - _raised[-1] >= _PAUSE_S):
        is_first = not _raised
        _raised.append(now)
        if not (_is_deferring and is_first):
            raise KeyboardInterrupt


@contextmanager
def deferred() -> Iterator[None]:
    """
    Raise the exception of a first signal at the end of this block, which must not end halfway.

    A second signal, a second later, is not deferred: the block may hang. Blocks are not nested.
    """
    global _is_deferring
    had_raised = bool(_raised)
    _is_deferring = True
    try:
        yield
    finally:
        _is_deferring = False
        if _raised and not had_raised:
            raise KeyboardInterrupt


def wait(seconds: float | None = None) -> None:
    """
    Wait for a number of seconds; None: without end.

    Other waits continue if the system delivers the signal to another thread of the process, or
    if the exception is lost, as in a destructor. This wait ends.

    :raises KeyboardInterrupt: a signal has arrived since ``raise_interrupts``.
    """
    deadline = math.inf if seconds is None else time.monotonic() + seconds
    while not _raised:
        left = None if seconds is None else max(deadline - time.monotonic(), 0.0)
        if not select.select([_pipe()[0]], [], [], left)[0]:
            return
        os.read(_pipe()[0], 1)  # of any signal that Python handles, also of others
    raise KeyboardInterrupt


def call_on_signal(callback: Callable[[], object]) -> None:
    """
    From now on, let the first signal call a function; signals have no other effect.

    A separate thread calls the function at once, even while the main thread waits in C code.
    """
    _handle(lambda *_: None)

    def notify() -> None:
        while os.read(_pipe()[0], 1)[0] not in _NUMBERS:
            pass
        callback()

    threading.Thread(target=notify, name='signals', daemon=True).start()


def ignore() -> None:
    """
    Ignore signals from now on, while the process ends.

    The handlers of the system are replaced first. Otherwise Python prints a traceback for a
    signal that arrived just before its own handlers are replaced.
    """
    for number in _NUMBERS:
        ctypes.pythonapi.PyOS_setsig(number, ctypes.c_void_p(signal.SIG_IGN))
    _handle(signal.SIG_IGN)


def _handle(handler: signal.Handlers | Callable[[int, object], object]) -> None:
    signal.set_wakeup_fd(_pipe()[1], warn_on_full_buffer=False)
    for number in _NUMBERS:
        signal.signal(number, handler)


@cache
def _pipe() -> tuple[int, int]:
    """Return the ends of a pipe; the interpreter writes the number of each signal into it."""
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    return read_end, write_end
