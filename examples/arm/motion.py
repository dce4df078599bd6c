# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joint positions over time, from a start to a goal."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Joints = npt.NDArray[np.float64]
"""Seven angles, radians."""

_RAMP_S = 0.25


def trapezoid(start: Joints, goal: Joints, speed: float, period_s: float) -> Iterator[Joints]:
    """
    Yield the joints after each period: even acceleration, constant speed, even deceleration.

    :param speed: the speed of the fastest joint, radians a second.
    """
    # Each of the two ramps covers half the distance of full speed, so both add one ramp of time.
    seconds = max(abs(goal - start).max() / speed + _RAMP_S, 2.0 * _RAMP_S)
    for number in range(1, round(seconds / period_s) + 1):
        yield start + (goal - start) * _progress(number * period_s, seconds)


def _progress(t: float, seconds: float) -> float:
    """Return the fraction of the way that is complete at a time; the ramps are parabolas."""
    whole_way = seconds - _RAMP_S
    left = max(seconds - t, 0.0)
    if t < _RAMP_S:
        return t * t / (2.0 * _RAMP_S * whole_way)
    if left < _RAMP_S:
        return 1.0 - left * left / (2.0 * _RAMP_S * whole_way)
    return (t - _RAMP_S / 2.0) / whole_way
