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

"""How a tool ends: what its exit status says, Ctrl-C, a closed pipe, one sentence for a fault."""

from collections.abc import Callable, Sequence
import importlib
import os
import signal
import sys
from typing import Any

FINE = 0
FOUND = 1
"""The tool has found something that somebody should look at."""
CANNOT = 2
"""The tool could not do its work; also for wrong arguments."""
INTERRUPTED = 130


class Cannot(Exception):
    """One sentence for the user; the tool prints it without a traceback and ends."""


def run(name: str, work: Callable[[Sequence[str]], int], argv: Sequence[str] | None) -> int:
    """
    Do a tool's work; return its exit status.

    SIGTERM is as Ctrl-C is: both raise ``KeyboardInterrupt`` in the work, which may catch it
    and end in order.

    :param work: takes the command line without the program's name; returns the status.
    :param argv: the whole command line; None: this process's.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        status = work(list(sys.argv if argv is None else argv)[1:])
        sys.stdout.flush()
        return status
    except Cannot as error:
        print(f'{name}: {error}', file=sys.stderr)
        return CANNOT
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has closed it, as `| head` does.
        _give_up_output()
        return FINE
    except OSError as error:  # the disk is full, say
        _give_up_output()
        print(f'{name}: {error}', file=sys.stderr)
        return CANNOT
    finally:
        # The process ends now: another Ctrl-C must not interrupt the end of the interpreter.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)


def entry_point(name: str, work: Callable[[Sequence[str]], int]) -> Callable[..., int]:
    """Return the ``main`` of a tool whose work that is; see ``run``."""
    def main(argv: Sequence[str] | None = None) -> int:
        """
        Run the command; return its exit status.

        :param argv: the whole command line; None: this process's.
        """
        return run(name, work, argv)

    return main


def _give_up_output() -> None:
    # The interpreter flushes stdout once more at its end, which would fail again.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def needs(module: str, package: str, extra: str) -> Any:
    """
    Return an imported module that not everybody has installed.

    :param package: its name on PyPI.
    :param extra: of this package, which installs it.
    :raises Cannot: it is not installed; the sentence says what to do.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or '').partition('.')[0] != module.partition('.')[0]:
            raise
        raise Cannot(f'this needs {package}, which is not installed: '
                     f"pip install 'tf_tree_py[{extra}]'") from error
