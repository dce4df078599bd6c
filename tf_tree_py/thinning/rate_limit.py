# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Limits the rate at which the samples of each frame are sent."""

from collections.abc import Iterable

from tf_tree_py.core.messages.sample import Sample


class RateLimit:
    """
    Sends at most one sample of each frame in a period: the newest.

    A sample that arrives after a pause is sent at once. One that arrives too early waits for
    its frame's turn, or is replaced by a newer one. So the last pose of a frame that stops
    moving is never lost. A sample costs O(1), and only the frames of the last period take
    memory. The caller provides the clock.
    """

    def __init__(self, period: float) -> None:
        """
        Start without samples.

        :param period: nanoseconds.
        """
        self._period = period
        # When each frame may be sent again, the earliest first: each is appended at the end,
        # because time only advances.
        self._turns: dict[str, float] = {}
        self._waiting: dict[str, Sample] = {}

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None if no sample waits."""
        return next(iter(self._turns.values()), None)

    def offer(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        """
        Take samples, and return those to send at once.

        :param now: nanoseconds of a clock that never goes back.
        """
        going: dict[str, Sample] = {}
        for sample in samples:
            child = sample.child
            if self._turns.get(child, now) <= now or child in going:
                going[child] = _newer(sample, going.get(child) or self._waiting.pop(child, None))
                self._next_turn_of(child, now)
            else:
                self._waiting[child] = _newer(sample, self._waiting.get(child))
        return list(going.values())

    def due(self, now: int) -> list[Sample]:
        """Return the waiting samples whose turn has come."""
        over = []
        for child, turn in self._turns.items():
            if turn > now:
                break
            over.append(child)
        going = []
        for child in over:
            del self._turns[child]
            if child in self._waiting:
                going.append(self._waiting.pop(child))
                self._next_turn_of(child, now)
        return going

    def _next_turn_of(self, child: str, now: int) -> None:
        self._turns.pop(child, None)
        self._turns[child] = now + self._period


def _newer(sample: Sample, other: Sample | None) -> Sample:
    return sample if other is None or sample.stamp >= other.stamp else other
