# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A step of the clock of the arrivals: that of the recorder, or of the listener."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import ANOTHER_CLOCK, from_seconds
from tf_tree_py.core.times import Stamps

from .spread import median, quantiles
from .timing import Timing

# A smaller step, or one that is not this many times as large as the delays vary, may be a delay.
_SMALLEST, _TIMES = from_seconds(0.1), 4.0
# The changes of the delays of all edges differ by less than this part of the step.
_ALIKE = 0.2
# An edge shows the step by this many samples before and after it.
_SEVERAL = 5


class ArrivalStep(NamedTuple):
    """
    A step of the clock of the arrivals.

    :ivar stamp: of the last sample before it, nanoseconds.
    :ivar received: when that arrived, by the clock before the step, nanoseconds.
    :ivar step: how far the clock was set forward, nanoseconds; negative: back.
    :ivar corrects: whether the clock agrees with the stamps after the step rather than before.
    """

    stamp: int
    received: int
    step: int
    corrects: bool

    def correct(self, received: Stamps, stamps: Stamps) -> Stamps:
        """Return the arrivals (N,) by the clock that agrees with the stamps (N,)."""
        later = stamps > self.stamp
        return received + self.step * ~later if self.corrects else received - self.step * later


def arrival_step(timings: Sequence[Timing]) -> ArrivalStep | None:
    """
    Return the step that the clock of the arrivals made, if there was one.

    In order of their stamps, the delays of all edges change at one moment by the same amount, for
    good, and the arrivals jump or overlap, not the stamps. The clock of a sender would move its
    stamps instead. In a simulation, a pause looks the same, so at least one part needs stamps of
    the same clock.
    """
    pairs = [_in_order(timing) for timing in timings]
    pairs = [each for each in pairs if len(each[0]) >= 2 * _SEVERAL]
    found = [step for received, stamps in pairs
             if (step := _step_of(received, stamps)) is not None]
    if not found:
        return None
    step = max(found, key=lambda each: each.stamp)
    moved = any(_moves_arrivals(timing, step.step) for timing in timings)
    return step if moved and all(_shows(step, *each) for each in pairs) else None


def _moves_arrivals(timing: Timing, step: float) -> bool:
    """Return whether arrivals jumped forward, or stamps overlap in order of arrival."""
    if timing.waits.most > 0.5 * abs(step):
        return step > 0.0 or timing.jumps > 0
    return step < 0.0 and (timing.disorders > 0 or timing.waits.least < 0.0)


def _in_order(timing: Timing) -> tuple[Stamps, Stamps]:
    """Return arrivals and stamps in order of the stamps."""
    kept = timing.pairs.kept
    ordered = kept[np.argsort(kept[:, 1], kind='stable')]
    return ordered[:, 0], ordered[:, 1]


def _step_of(received: Stamps, stamps: Stamps) -> ArrivalStep | None:
    """Return where the delays of one edge change most, if they are steady before and after."""
    place = int(np.abs(np.diff(received - stamps)).argmax()) + 1
    step, varies = _change(received - stamps, place)
    if abs(step) < max(_SMALLEST, _TIMES * varies):
        return None
    before, after = (abs(median(part)) for part in np.split(received - stamps, [place]))
    if min(before, after) > ANOTHER_CLOCK:
        return None
    return ArrivalStep(int(stamps[place - 1]), int(received[:place].max()), round(step),
                       after < before)


def _change(delays: Stamps, place: int) -> tuple[float, float]:
    """Return by how much delays change at a place, and how much they vary beside it."""
    if not _SEVERAL <= place <= len(delays) - _SEVERAL:
        return 0.0, 0.0
    parts: list[Array] = [np.sort(part) for part in np.split(delays.astype(float), [place])]
    (low, usual, high), (later_low, later, later_high) = (
        quantiles(part, (0.05, 0.5, 0.95)) for part in parts)
    return later - usual, max(high - low, later_high - later_low)


def _shows(step: ArrivalStep, received: Stamps, stamps: Stamps) -> bool:
    """Return whether the delays of an edge change by a step, as far as it shows them."""
    place = int(np.count_nonzero(stamps <= step.stamp))
    if not _SEVERAL <= place <= len(stamps) - _SEVERAL:
        return True  # it began later, or ended before
    change, varies = _change(received - stamps, place)
    return abs(change - step.step) < max(_ALIKE * abs(step.step), varies)
