# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Selects which moving samples to send, by their rates and by the motion of their frames."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
import math

from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND

from .dead_band import DeadBand
from .rate_limit import RateLimit


class Thinner:
    """
    Selects a part of all samples: first by each frame's rate, then by its motion.

    The error of the receiver's interpolation is at most the sum of two bounds. The dead band
    contributes twice its thresholds (``DeadBand``). The rate limit contributes the error of
    linear interpolation, a T^2/8 for an acceleration a and samples that are T apart
    (de Boor, "A Practical Guide to Splines", chapter III). T is the period of the limit plus
    that of the frame. The caller provides the clock.
    """

    def __init__(self, *, rate_hz: float = 0.0, rates: Mapping[str, float] | None = None,
                 min_move: float = 0.0, min_turn: float = 0.0, max_silence: float = 1.0) -> None:
        """
        Start without samples.

        :param rate_hz: the maximum rate of each frame; 0: no limit.
        :param rates: the same for single frames, by the child of their edge.
        :param min_move: a frame that moves less than this is at rest, metres. If this and
            ``min_turn`` are 0, frames at rest are sent too.
        :param min_turn: the same for the rotation, radians.
        :param max_silence: seconds after which a frame at rest is sent anyway.
        :raises ValueError: one of them is invalid.
        """
        self._rate_hz = _checked('rate_hz', rate_hz)
        self._rates = {frame: _checked(f'the rate of {frame!r}', rate)
                       for frame, rate in (rates or {}).items()}
        self._pacings = {rate: RateLimit(NANOSECONDS_PER_SECOND / rate)
                         for rate in (self._rate_hz, *self._rates.values()) if rate}
        thresholds = _checked('min_move', min_move), _checked('min_turn', min_turn)
        if not _checked('max_silence', max_silence):
            raise ValueError('max_silence must be greater than zero')
        self._dead_band = DeadBand(
            *thresholds, max_silence * NANOSECONDS_PER_SECOND) if any(thresholds) else None

    @property
    def next_turn(self) -> float | None:
        """Return when to call ``due`` next, nanoseconds; None if no sample waits."""
        stages = (*self._pacings.values(), *([self._dead_band] if self._dead_band else ()))
        return min((stage.next_turn for stage in stages if stage.next_turn is not None),
                   default=None)

    def offer(self, samples: Collection[Sample], now: int) -> Collection[Sample]:
        """
        Take samples, and return those to send at once.

        :param now: nanoseconds of a clock that never goes back.
        """
        paced = self._paced(samples, now) if self._pacings else samples
        return paced if self._dead_band is None else self._dead_band.offer(paced, now)

    def due(self, now: int) -> Collection[Sample]:
        """Return the waiting samples whose turn has come."""
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
        raise ValueError(f'{what} must be a finite number, zero or greater, not {number!r}')
    return number
