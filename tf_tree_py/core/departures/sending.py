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

"""Hands samples to what sends them: moving ones in their turn, static ones all together."""

from collections.abc import Callable, Collection
import math
import threading
import time

from .thinning import Thinning
from ..arrivals.sample import Sample
from ..buffer.buffer_core import DEFAULT_MAX_FRAMES
from ..stamp import NANOSECONDS_PER_SECOND

# Sends one message; it must not raise.
Send = Callable[[Collection[Sample]], None]


class Moving:
    """
    Sends moving transforms, thinned out.

    ``take`` may be called in any thread. What has to wait is sent in a thread of its own,
    which sleeps while nothing waits.
    """

    def __init__(self, send: Send, thinning: Thinning) -> None:
        """Begin to send; until ``close``."""
        self._send_message = send
        self._thinning = thinning
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(
            target=self._send_what_waited, name='thinning', daemon=True)
        self._thread.start()

    @property
    def next_turn(self) -> float:
        """Return when it sends next by itself, of the monotonic clock; infinity: nothing waits."""
        with self._changed:
            turn = self._thinning.next_turn
            return math.inf if turn is None else turn

    def take(self, samples: Collection[Sample]) -> None:
        """Send samples, now or when their frame may go again, or not at all."""
        with self._changed:
            if self._closed:
                return
            before = self.next_turn
            self._send(self._thinning.offer(samples, time.monotonic_ns()))
            if self.next_turn < before:
                self._changed.notify()

    def close(self) -> None:
        """End the thread; samples that still wait are not sent."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _send_what_waited(self) -> None:
        with self._changed:
            while not self._closed:
                now = time.monotonic_ns()
                self._send(self._thinning.due(now))
                self._changed.wait(min(
                    (self.next_turn - now) / NANOSECONDS_PER_SECOND, threading.TIMEOUT_MAX))

    def _send(self, samples: Collection[Sample]) -> None:
        if samples:
            self._send_message(samples)


class Static:
    """Sends static transforms, each time all of them, for late joiners; from any thread."""

    def __init__(self, send: Send) -> None:
        """Begin without transforms."""
        self._send_message = send
        self._lock = threading.Lock()
        self._latest: dict[str, Sample] = {}

    def take(self, samples: Collection[Sample]) -> None:
        """Send samples at once; for each child the newest counts."""
        with self._lock:
            for sample in samples:
                # Every message holds all of them: a faulty publisher must not make it grow for
                # ever.
                if sample.child in self._latest or len(self._latest) < DEFAULT_MAX_FRAMES:
                    self._latest[sample.child] = sample
            if samples:
                self._send_message(self._latest.values())
