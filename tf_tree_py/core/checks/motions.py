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

"""Steps between samples that are too large for a motion."""

from collections.abc import Iterator
from math import degrees
from typing import Any

from .case import Case
from .check import check, of_edge, Remark
from .finding import Number, Severity
from ..stamp import format_span, format_stamp
from ..text import times
from ..vitals.edge import EdgeRecord
from ..vitals.motion import Jump


@check(Severity.WARNING,
       catches='a frame that jumps faster than anything moves',
       cause='an estimator that was reset, an encoder that wrapped around, or an outlier that '
             'nobody has filtered',
       fix='look at what its publisher did at that stamp; --max-speed and --max-turn-rate say '
           'what is still motion')
def pose_jump(case: Case) -> Iterator[Remark]:
    """Find steps that are faster than the limits; those of a localiser have their own cause."""
    for edge, moving in case.moving():
        jump = moving.motion.fast
        if not jump.count:
            continue
        seconds = jump.time / 1e9
        evidence = _evidence(jump) | {
            'speed_m_s': jump.gone / seconds, 'turn_rate_deg_s': degrees(jump.turned) / seconds}
        yield of_edge(edge, _in_words(jump), evidence, **_of_localiser(case, edge))


@check(Severity.WARNING, textbook=True,
       catches='a jump between two samples that are far apart in time',
       cause='an edge that is sent seldom and corrected in one step, such as a slow localiser',
       fix='send it more often, also while it does not change: every lookup between the two '
           'samples gets a pose, interpolated, that never was')
def interpolated_jump(case: Case) -> Iterator[Remark]:
    """Find large steps that take long, while the edge rests before and after."""
    for edge, moving in case.moving():
        jump = moving.motion.slow
        if jump.count:
            yield of_edge(edge, f'{_in_words(jump)}: lookups in between get poses that never were',
                          _evidence(jump))


def _in_words(jump: Jump) -> str:
    return (f'jumped {times(jump.count)}, at most by {jump.gone:.3g} m and '
            f'{degrees(jump.turned):.3g} deg in {format_span(jump.time)} after '
            f'{format_stamp(jump.stamp)} s')


def _evidence(jump: Jump) -> dict[str, Number]:
    return {'count': jump.count, 'after_stamp_s': jump.stamp / 1e9, 'time_s': jump.time / 1e9,
            'gone_m': jump.gone, 'turned_deg': degrees(jump.turned)}


def _of_localiser(case: Case, edge: EdgeRecord) -> dict[str, Any]:
    if not case.is_correction(edge):
        return {}
    return {'severity': Severity.NOTE,
            'cause': 'a correction of the localiser: it may jump, for what moves smoothly is '
                     'the edge below it',
            'fix': f'plan and control in {edge.child}; only goals belong in {edge.parent}'}
