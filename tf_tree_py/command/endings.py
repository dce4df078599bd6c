# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The end of a program: exit statuses, Ctrl-C, closed pipes, and errors in one sentence."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import importlib
import os
import sys
from types import ModuleType

from . import signals

FINE = 0
FOUND = 1
"""A tool found a problem."""
CANNOT = 2
"""The program could not do its work, or its arguments are wrong."""
INTERRUPTED = 130


class Cannot(Exception):
    """
    An error that a program prints as one sentence, without a traceback, before it ends.

    Several lines are joined: the hint of a lookup error is on a line of its own.
    """

    def __init__(self, sentence: str) -> None:
        super().__init__(' '.join(sentence.splitlines()))


@contextmanager
def cannot_after(*errors: type[Exception], ending: type[Cannot] = Cannot) -> Iterator[None]:
    """
    Raise ``Cannot`` instead of errors whose texts are sentences for users.

    :param ending: a subclass of it.
    """
    try:
        yield
    except errors as error:
        raise ending(str(error)) from error


@contextmanager
def cannot_be(done: str, path: object) -> Iterator[None]:
    """
    Raise ``Cannot`` instead of an ``OSError``, with its reason.

    :param done: what cannot be done with the file, such as ``written``.
    """
    try:
        yield
    except OSError as error:
        raise Cannot(f'{path} cannot be {done}: {error.strerror}') from error


def run(name: str, work: Callable[[list[str]], int], argv: Sequence[str] | None = None,
        interrupted: int = INTERRUPTED) -> int:
    """
    Do the work of a program; return its exit status.

    SIGTERM has the same effect as Ctrl-C. Either ends the process at once, until the work starts
    something that needs an orderly end and calls a function of ``signals``. After this function
    returns, signals are ignored, and the process should end.

    :param work: receives the command line without the program's name; returns the status.
    :param argv: the whole command line; None: that of this process.
    :param interrupted: the status after a signal.
    """
    signals.end_at_once(interrupted)
    try:
        status = _status_of(name, work, list(sys.argv if argv is None else argv)[1:])
    except KeyboardInterrupt:
        status = interrupted
    finally:
        signals.over = True  # before any call
        signals.ignore()
    return status


def _status_of(name: str, work: Callable[[list[str]], int], arguments: list[str]) -> int:
    """Do the work; return its status, or that of its error."""
    try:
        status = work(arguments)
        sys.stdout.flush()
        return status
    except Cannot as error:
        print(f'{name}: {error}', file=sys.stderr)
        return CANNOT
    except BrokenPipeError:
        # The reader of the output has closed it, as `| head` does.
        _give_up_output()
        return FINE
    except OSError as error:  # for example, the disk is full
        _give_up_output()
        place = f'{error.filename}: ' if error.filename else ''
        print(f'{name}: {place}{error.strerror or error}', file=sys.stderr)
        return CANNOT


def entry_point(name: str, work: Callable[[list[str]], int]) -> Callable[..., int]:
    """Return the ``main`` of a program that does some work; see ``run``."""
    def main(argv: Sequence[str] | None = None) -> int:
        """
        Run the command; return its exit status.

        :param argv: the whole command line; None: that of this process.
        """
        return run(name, work, argv)

    return main


def _give_up_output() -> None:
    # The interpreter flushes stdout once more at its end, which would fail again.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def needs(module: str, package: str) -> ModuleType:
    """
    Import and return an optional module.

    :param package: its name on PyPI.
    :raises Cannot: it is not installed; the message names the package to install.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or '').partition('.')[0] != module.partition('.')[0]:
            raise
        raise Cannot(f'this needs {package}, which is not installed: '
                     f'pip install {package}') from error


def needs_ros(what: str, error: ModuleNotFoundError, instead: str = '') -> Cannot:
    """
    Return the error for a failed import of ROS 2.

    :param what: names what needs ROS 2; it begins the message.
    :param instead: an alternative for the user; it ends the message.
    :raises ModuleNotFoundError: another module is missing, which is a defect of this package.
    """
    missing = (error.name or '').partition('.')[0]
    if missing in ('', 'tf_tree_py'):
        raise error
    return Cannot(f'{what}needs ROS 2, and {missing} is not installed: source a ROS 2 '
                  'installation, or run scripts/setup of the tf_tree_py repository to install one '
                  f'from PyPI{instead}')
