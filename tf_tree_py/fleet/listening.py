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

"""Threads that take what Zenoh delivers."""

from collections.abc import Callable, Iterable
import logging
import threading
from typing import Any

log = logging.getLogger('tf_tree_py.fleet')

# So much may wait for its thread; then Zenoh waits too, and the sender's router drops.
_WAITING = 10_000


class Threads:
    """
    One thread for each channel of Zenoh, until the channel ends.

    Zenoh would call callbacks from threads that nobody can wait for, and aborts the process
    where the interpreter ends before them.
    """

    def __init__(self, new_channel: Callable[[int], Any]) -> None:
        """
        Begin with none.

        :param new_channel: ``zenoh.handlers.FifoChannel``.
        """
        self._new_channel = new_channel
        self._threads: list[threading.Thread] = []

    def channel(self) -> Any:
        """Return a handler for something that is to be declared, and then taken from."""
        return self._new_channel(_WAITING)

    def take_all(self, handler: Iterable[Any], take: Callable[[Any], object], what: str) -> None:
        """Let a thread take what comes, until what was declared is undeclared."""
        thread = threading.Thread(target=_take_all, args=(handler, take), name=f'fleet {what}',
                                  daemon=True)
        thread.start()
        self._threads = [one for one in self._threads if one.is_alive()] + [thread]

    def join(self) -> None:
        """Wait for all to end, of which each has nothing more to take."""
        for thread in self._threads:
            thread.join()


def _take_all(handler: Iterable[Any], take: Callable[[Any], object]) -> None:
    for one in handler:
        try:
            take(one)
        except Exception:  # noqa: B902 - the next may be well
            log.exception('a fault of tf_tree_py.fleet, at what it was delivered')
