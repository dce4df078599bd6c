# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Senders of samples: moving ones are thinned out, static ones are sent all together."""

from collections.abc import Callable, Collection
import math
import threading
import time

from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND

from .thinner import Thinner

# Sends one message; it must not raise.
Send = Callable[[Collection[Sample]], None]


class MovingSender:
    """
    Sends moving transforms, thinned out.

    ``take`` is thread-safe. Samples that must wait are sent by an internal thread, which
    sleeps while none waits.
    """

    def __init__(self, send: Send, thinning: Thinner) -> None:
        """Start the internal thread, which runs until ``close``."""
        self._send_message = send
        self._thinning = thinning
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(
            target=self._send_what_waited, name='thinning', daemon=True)
        self._thread.start()

    @property
    def next_turn(self) -> float:
        """Return when the thread sends next, by the monotonic clock; infinity if none waits."""
        with self._changed:
            turn = self._thinning.next_turn
            return math.inf if turn is None else turn

    def take(self, samples: Collection[Sample]) -> None:
        """Take samples, and send each at once, at its frame's turn, or not at all."""
        with self._changed:
            if self._closed:
                return
            before = self.next_turn
            self._send(self._thinning.offer(samples, time.monotonic_ns()))
            if self.next_turn < before:
                self._changed.notify()

    def close(self) -> None:
        """Stop the thread; samples that still wait are not sent."""
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


class StaticSender:
    """Sends all static transforms together, for late subscribers; thread-safe."""

    def __init__(self, send: Send) -> None:
        """Begin without transforms."""
        self._send_message = send
        self._lock = threading.Lock()
        self._latest: dict[str, Sample] = {}

    def take(self, samples: Collection[Sample]) -> None:
        """Send all samples, after replacing those of the same children by these."""
        with self._lock:
            for sample in samples:
                # Every message contains all of them: a faulty publisher must not make it grow
                # without limit.
                if sample.child in self._latest or len(self._latest) < DEFAULT_MAX_FRAMES:
                    self._latest[sample.child] = sample
            if samples:
                self._send_message(self._latest.values())
