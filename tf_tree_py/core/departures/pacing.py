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

"""Limits how often each frame is passed on; no clock of its own."""

from collections.abc import Iterable

from ..arrivals.sample import Sample


class Pacing:
    """
    Lets at most one sample of each frame through in a period, the newest.

    A sample that comes after a pause goes at once. One that comes too soon waits for its
    frame's turn, unless a newer one takes its place. So the last pose of a frame that stops
    moving is never lost. It costs O(1) a sample, and memory for the frames of the last
    period only.
    """

    def __init__(self, period: float) -> None:
        """
        Begin without samples.

        :param period: nanoseconds.
        """
        self._period = period
        # When each frame may go again, the earliest first: each is put at the end, as time only
        # goes forward.
        self._turns: dict[str, float] = {}
        self._waiting: dict[str, Sample] = {}

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None: nothing can be due."""
        return next(iter(self._turns.values()), None)

    def offer(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        """
        Take samples, and return those that may go at once.

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
        """Return those that waited and may go by now."""
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
