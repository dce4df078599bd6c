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

"""Which moving samples go out, by rates and by what moved; no clock of its own."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
import math

from .dead_band import DeadBand
from .pacing import Pacing
from ..arrivals.sample import Sample
from ..stamp import NANOSECONDS_PER_SECOND


class Thinning:
    """
    Lets a part of all samples through: first by each frame's rate, then by what moved.

    What the other side interpolates is off by at most the sum of two bounds. What the
    dead band holds back costs twice its thresholds (``DeadBand``). What a rate leaves out
    costs what a straight line costs, a T^2/8 for an acceleration a and samples that are T apart
    (linear interpolation: de Boor, "A Practical Guide to Splines", chapter III). T is one
    period and one of the frame's own.
    """

    def __init__(self, *, rate_hz: float = 0.0, rates: Mapping[str, float] | None = None,
                 min_move: float = 0.0, min_turn: float = 0.0, max_silence: float = 1.0) -> None:
        """
        Begin without samples.

        :param rate_hz: how often each frame goes at most; 0: as often as it comes.
        :param rates: the same for single frames, by the child of their edge.
        :param min_move: metres within which a frame is at rest. If this and ``min_turn`` are
            0, also what rests goes.
        :param min_turn: radians, likewise.
        :param max_silence: seconds after which a frame at rest goes all the same.
        :raises ValueError: one of them is no such number.
        """
        self._rate_hz = _checked('rate_hz', rate_hz)
        self._rates = {frame: _checked(f'the rate of {frame!r}', rate)
                       for frame, rate in (rates or {}).items()}
        self._pacings = {rate: Pacing(NANOSECONDS_PER_SECOND / rate)
                         for rate in (self._rate_hz, *self._rates.values()) if rate}
        thresholds = _checked('min_move', min_move), _checked('min_turn', min_turn)
        if not _checked('max_silence', max_silence):
            raise ValueError('max_silence has to be greater than zero')
        self._dead_band = DeadBand(
            *thresholds, max_silence * NANOSECONDS_PER_SECOND) if any(thresholds) else None

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None: nothing can be due."""
        stages = (*self._pacings.values(), *([self._dead_band] if self._dead_band else ()))
        return min((stage.next_turn for stage in stages if stage.next_turn is not None),
                   default=None)

    def offer(self, samples: Collection[Sample], now: int) -> Collection[Sample]:
        """
        Take samples, and return those that may go at once.

        :param now: nanoseconds of a clock that never goes back.
        """
        paced = self._paced(samples, now) if self._pacings else samples
        return paced if self._dead_band is None else self._dead_band.offer(paced, now)

    def due(self, now: int) -> Collection[Sample]:
        """Return those that waited and may go by now."""
        paced = [sample for pacing in self._pacings.values() for sample in pacing.due(now)]
        if self._dead_band is None:
            return paced
        return [*self._dead_band.offer(paced, now), *self._dead_band.due(now)]

    def _paced(self, samples: Iterable[Sample], now: int) -> list[Sample]:
        by_rate = defaultdict[float, list[Sample]](list)
        for sample in samples:
            by_rate[self._rates.get(sample.child, self._rate_hz)].append(sample)
        return [sample for rate, group in by_rate.items()
                for sample in (self._pacings[rate].offer(group, now) if rate else group)]


def _checked(what: str, number: float) -> float:
    if not 0.0 <= number < math.inf:
        raise ValueError(f'{what} has to be a finite number, zero or greater, not {number!r}')
    return number
