# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The end of a program: Python waits for the calls of Zenoh in daemon threads.

Python stops a daemon thread where it next needs the interpreter. Zenoh is Rust, which does not
allow a thread to be stopped while it returns, so it aborts the process ("FATAL: exception not
rethrown"). Python 3.14 does not stop such threads, it leaves them waiting.
"""

import atexit
from collections.abc import Iterator
from contextlib import contextmanager
import threading
import time

# How long the end of a program waits for calls. An attempt to connect may last half a second
# longer than ``close()`` of a listener waits for it.
END_S = 1.5
_POLL_S = 0.005

# The threads in a call; a nested call counts again. There is no lock, because a process that forks
# could copy it while it is locked. The methods of lists are atomic.
_calling: list[threading.Thread] = []
_ending: list[threading.Thread] = []


@contextmanager
def zenoh_call() -> Iterator[None]:
    """
    Run calls of Zenoh that the end of the program waits for.

    While the program ends, other threads begin none. They wait here, because leaving their
    functions would release objects of Zenoh, and that calls Zenoh, too.

    :raises SystemExit: the program still has not ended; this ends a thread without a message.
    """
    thread = threading.current_thread()
    nested = thread in _calling
    # First, so that the end of the program sees this thread, or this thread sees the end.
    _calling.append(thread)
    if _ending and thread not in _ending and not nested:
        _calling.remove(thread)
        time.sleep(END_S)
        raise SystemExit
    try:
        yield
    finally:
        _calling.remove(thread)


@atexit.register
def _await_calls() -> None:
    """Wait for other threads. Listeners were created, and so are closed, before that."""
    this = threading.current_thread()
    _ending.append(this)
    end = time.monotonic() + END_S
    # After a fork, threads of the parent are not alive.
    while (any(one is not this and one.is_alive() for one in tuple(_calling))
           and time.monotonic() < end):
        time.sleep(_POLL_S)
