# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Steps of the clock that stamps an edge, while its messages continue to arrive."""

from typing import NamedTuple

import numpy as np
from tf_tree_py.core.stamp import from_seconds

from .sample_rows import JUDGED, Steps
from .spread import median

# A smaller step, or one of fewer usual intervals, may be a late timer.
_SMALLEST = from_seconds(0.1)
_INTERVALS = 4.0


class ClockStep(NamedTuple):
    """
    One step of a clock.

    :ivar received: when the last sample before it arrived, nanoseconds.
    :ivar step: how much further the stamps advanced than the arrivals, nanoseconds.
    """

    received: int
    step: int


def clock_steps(steps: Steps, interval: float) -> list[ClockStep]:
    """
    Return the steps of a clock among the steps that are judged.

    :param interval: the usual interval between stamps, nanoseconds.
    """
    least = max(_SMALLEST, _INTERVALS * interval)
    if not interval or np.abs(steps.time[JUDGED] - interval).max() <= least:
        return []
    waited = median(steps.waited)
    # Convert to the clock of the stamps, whose pace may differ from that of the arrivals.
    pace = interval / waited if waited > 0.0 else 1.0
    lead = (steps.time - interval) - (steps.waited - waited) * pace
    here, size = lead[JUDGED], np.abs(lead[JUDGED])
    # The step to or from a single wrong stamp is reversed by the next or the previous step.
    stays = (np.minimum(np.abs(here + lead[:-3]), np.abs(here + lead[2:-1])) > 0.5 * size)
    arrives = ((np.abs(steps.waited[JUDGED] - waited) * pace < 0.5 * size)
               & (steps.received[JUDGED] > 0))
    found = np.flatnonzero((size > least) & stays & arrives) + 1
    return [ClockStep(int(steps.received[place]), round(float(lead[place]))) for place in found]
