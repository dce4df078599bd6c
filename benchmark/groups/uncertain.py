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

"""What is beyond tf2: it may cost those nothing who do not use it."""

from collections.abc import Callable, Iterator

import numpy as np
from tf_tree_py.core import BufferCore, Pose

from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import Row, scaled
from ..timing import interleave, time_each

_PLAIN, _BESIDE, _AIDED = 'plain', 'the same, edges uncertain', 'the same, edges aided'
_IDLE = 'the same, edges corrected'
_UNCERTAIN, _LARGE, _AHEAD = 'lookup_uncertain', 'lookup_uncertain, 2 deg', 'predict, 50 ms ahead'
_ABOUT_THE_SAME = 1.03
_CORRECTED_AT_MOST = 1.05

_FRAMES = ('map', 'odom', 'base', 'torso', 'head', 'camera')
_STEP, _COUNT = 10_000_000, 1000
_ASKED = _STEP * _COUNT // 2


def _filled(degrees: float | None = None) -> BufferCore:
    """Return five moving edges; with a covariance each, if a deviation is given."""
    covariance = None if degrees is None else np.diag(
        [1e-6] * 3 + [np.radians(degrees) ** 2] * 3)
    buffer = BufferCore()
    for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False):
        for stamp in range(_STEP, _STEP * _COUNT + 1, _STEP):
            buffer.insert(parent, child, stamp, Pose.from_xyz_rpy(x=1.0, yaw=1e-9 * stamp),
                          covariance=covariance)
    return buffer


def _aided() -> BufferCore:
    buffer = _filled()
    stamps = np.arange(0, _STEP * _COUNT + 1, _STEP // 10)
    for child in _FRAMES[1:]:
        buffer.aid(child, stamps, np.full((len(stamps), 3), (0.0, 0.0, 1.0)))
    return buffer


def _corrected() -> BufferCore:
    """Return edges that have absorbed corrections, wholly before what is asked for."""
    buffer = BufferCore()
    for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False):
        for stamp in range(_STEP, _STEP * _COUNT + 1, _STEP):
            buffer.insert(parent, child, stamp, Pose.from_xyz_rpy(x=1.0, yaw=1e-9 * stamp))
            if stamp == _STEP:
                buffer.correct(child, Pose(x=0.1), over=_STEP)
    return buffer


def _asking(ask: Callable[..., object], count: int, *more: int,
            stamp: int = _ASKED) -> Callable[[], float]:
    """Return a turn of lookups, each for another stamp."""
    def turn() -> float:
        stamps = iter(range(stamp, stamp + count))
        return time_each(lambda: ask('map', 'camera', next(stamps), *more), count)

    return turn


def uncertain(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups over five moving edges, uncertain, aided and predicted."""
    plain, small, large, aided = _filled(), _filled(0.1), _filled(2.0), _aided()
    corrected = _corrected()
    few = max(effort.lookups // 50, 1)
    turns = {
        _PLAIN: _asking(plain.lookup, effort.lookups),
        _BESIDE: _asking(small.lookup, effort.lookups),
        _IDLE: _asking(corrected.lookup, effort.lookups),
        _AIDED: _asking(aided.lookup, effort.lookups),
        _UNCERTAIN: _asking(small.lookup_uncertain, few),
        _LARGE: _asking(large.lookup_uncertain, few),
        _AHEAD: _asking(plain.predict, few, 10**9, stamp=_STEP * _COUNT + 50_000_000),
    }
    row = Row('uncertain', '5 moving edges', 'us', scaled(interleave(turns, effort.rounds), 1e6))
    row.compare(_BESIDE, _PLAIN, _ABOUT_THE_SAME, name='a plain lookup of uncertain edges',
                unit='x one of certain edges')
    row.compare(_IDLE, _PLAIN, _CORRECTED_AT_MOST, name='a plain lookup of corrected edges',
                unit='x one of edges that never were')
    for name in (_AIDED, _UNCERTAIN, _LARGE, _AHEAD):
        row.compare(name, _PLAIN, name=name, unit='x a plain lookup')
    yield row
