# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Threads that receive what Zenoh delivers."""

from collections.abc import Callable, Iterator
from contextlib import suppress
import logging
import threading
from typing import Any

from .session import needs_zenoh

log = logging.getLogger('tf_tree_py.fleet')

# This many samples may wait for the thread that sorts them. Beyond that Zenoh waits, too, and the
# router of the sender drops messages.
_WAITING = 200
# This many are taken at once: each wait releases the interpreter, and other threads may hold it
# for long.
_AT_ONCE = 100


class WorkerThreads:
    """
    Threads for the channels of Zenoh, one for each, and for other work.

    Zenoh would run callbacks in threads that cannot be joined. They abort the process if the
    interpreter ends first.
    """

    def __init__(self, new_channel: Callable[[int], Any]) -> None:
        """
        Begin without threads.

        :param new_channel: ``zenoh.handlers.FifoChannel``.
        """
        self._new_channel = new_channel
        self._threads: list[threading.Thread] = []

    def channel(self) -> Any:
        """Return a handler for a declaration, from which samples are taken."""
        return self._new_channel(_WAITING)

    def take_all(self, handler: Any, take: Callable[[Any], object], what: str) -> None:
        """Start a thread that takes samples until their declaration is undeclared."""
        self.start(lambda: _take_all(handler, take), what)

    def start(self, work: Callable[[], object], what: str) -> None:
        """Start a thread for work that ends when everything is closed."""
        thread = threading.Thread(target=work, name=f'fleet {what}', daemon=True)
        thread.start()
        self._threads = [one for one in self._threads if one.is_alive()] + [thread]

    def join(self) -> None:
        """Wait for the threads to end; their declarations are undeclared."""
        for thread in self._threads:
            thread.join()


def _take_all(handler: Any, take: Callable[[Any], object]) -> None:
    for one in _in_turn(handler):
        try:
            take(one)
        except Exception:  # noqa: B902 - the next may be valid
            log.exception('internal error of tf_tree_py.fleet in a delivery')


def _in_turn(handler: Any) -> Iterator[Any]:
    """Yield samples until their declaration is undeclared."""
    for first in handler:
        yield first
        with suppress(needs_zenoh().ZError):  # it was undeclared in the meantime
            for _ in range(_AT_ONCE):
                one = handler.try_recv()
                if one is None:
                    break
                yield one
