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

"""A line on stderr that says what is being done, if it takes longer than two seconds."""

from collections.abc import Iterator
from contextlib import contextmanager
import sys
import threading
import time

PATIENCE_S = 2.0
"""How long nothing is said."""

_TERMINAL_S, _LOG_S = 1.0, 20.0


@contextmanager
def progress(what: str) -> Iterator[None]:
    """
    Print to stderr what is being done, and for how long; not in the first 2 s.

    On a terminal one line counts the seconds, and is erased in the end. A log gets a line
    from time to time.

    :param what: such as ``tf_lab: latency, between processes``.
    """
    done = threading.Event()
    teller = threading.Thread(target=_tell, args=(what, done), name='progress', daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()


def _tell(what: str, done: threading.Event) -> None:
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
