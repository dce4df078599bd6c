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

"""How joints go from one place to another in time."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Joints = npt.NDArray[np.float64]
"""Seven angles, radians."""

_RAMP_S = 0.25


def trapezoid(start: Joints, goal: Joints, speed: float, period_s: float) -> Iterator[Joints]:
    """
    Yield the joints after each period: they speed up evenly, go on, and slow down evenly.

    :param speed: that of the fastest joint, radians a second.
    """
    # At full speed for all but two ramps, each of which costs half its length.
    seconds = max(abs(goal - start).max() / speed + _RAMP_S, 2.0 * _RAMP_S)
    for number in range(1, round(seconds / period_s) + 1):
        yield start + (goal - start) * _progress(number * period_s, seconds)


def _progress(t: float, seconds: float) -> float:
    """Return which part of the way is behind one at a time; the ramps are parabolas."""
    whole_way = seconds - _RAMP_S
    left = max(seconds - t, 0.0)
    if t < _RAMP_S:
        return t * t / (2.0 * _RAMP_S * whole_way)
    if left < _RAMP_S:
        return 1.0 - left * left / (2.0 * _RAMP_S * whole_way)
    return (t - _RAMP_S / 2.0) / whole_way
