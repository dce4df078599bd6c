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

"""What does not move, and what pretends to."""

from collections.abc import Iterator
from math import degrees

from .case import Case
from .check import check, of_edge, Remark
from .finding import Severity
from ..stamp import from_seconds
from ..text import times
from ..vitals.edge import EdgeRecord

# An edge that has not moved for this long, in this many samples, does not move.
_LONG = from_seconds(4.0)
_MANY = 20
# Radians: half a degree.
_TILTED = 0.009


@check(Severity.WARNING, textbook=True,
       catches='an edge that is sent again and again on /tf and never changes',
       cause='a calibration, or a fixed joint, that is published like something that moves',
       fix='send it once on /tf_static: it costs nothing there, and answers at every stamp, also '
           'when its sender has died')
def static_republished(case: Case) -> Iterator[Remark]:
    """Find edges that stand still to the last bit while others move."""
    if not any(moving.motion.moved for _, moving in case.moving()):
        return  # the robot stands
    moved = {edge.frames for edge, moving in case.moving() if moving.motion.moved}
    for edge, moving in case.moving():
        timing = moving.timing
        if moving.motion.moved or timing.count < _MANY or timing.span < _LONG:
            continue
        # A joint at rest comes with those that move.
        is_joint = any(other in moved for other in moving.beside)
        yield of_edge(
            edge, f'was sent {times(timing.count)} in {timing.span / 1e9:.1f} s, at '
            f'{timing.rate_hz:.1f} Hz, and never changed',
            {'count': timing.count, 'rate_hz': timing.rate_hz, 'span_s': timing.span / 1e9},
            severity=Severity.NOTE if is_joint or _may_rest(case, edge) else None,
            cause='a joint or a localiser at rest; or a calibration that comes with what moves'
            if is_joint or _may_rest(case, edge) else '')


def _may_rest(case: Case, edge: EdgeRecord) -> bool:
    # A localiser that has nothing to correct sends the same value all the time.
    return case.is_correction(edge)


@check(Severity.WARNING, textbook=True,
       catches='a static transform that was sent again with another value',
       cause='a calibration that changed while the system ran, or two files that hold it',
       fix='let one place hold it. Whoever composed with the old value has to be told: a buffer '
           'knows only the newest, also for old stamps')
def static_changed(case: Case) -> Iterator[Remark]:
    """Find static edges whose value changed."""
    for edge in case.edges:
        fixed = edge.fixed
        if fixed is not None and fixed.changes:
            yield of_edge(
                edge, f'is static and changed {times(fixed.changes)}, by up to '
                f'{fixed.gone:.4g} m and {degrees(fixed.turned):.4g} deg',
                {'changes': fixed.changes, 'gone_m': fixed.gone,
                 'turned_deg': degrees(fixed.turned)})


@check(Severity.ERROR,
       explains=('static_changed', 'static_republished', 'pose_jump', 'interpolated_jump',
                 'gap', 'irregular_rate', 'two_publishers'),
       catches='an edge that is sent both as static and as moving',
       cause='two nodes send it: a URDF that has the joint as fixed beside a driver, for instance',
       fix='stop one of them: with each change of kind a buffer forgets what it had')
def kind_flips(case: Case) -> Iterator[Remark]:
    """Find edges that arrived on both kinds of topic."""
    for edge in case.edges:
        if edge.fixed is not None and edge.moving is not None:
            count = edge.moving.timing.count
            yield of_edge(
                edge, f'came {times(edge.fixed.count)} as static and {times(count)} as moving',
                {'static': edge.fixed.count, 'moving': count})


@check(Severity.NOTE, textbook=True,
       catches='an edge without any roll and pitch below one that tilts',
       cause='a planar odometry or localiser on a robot that does tilt',
       fix='keep the tree spatial, and project last: what is h above the ground is h sin(tilt) '
           'off')
def planar_only(case: Case) -> Iterator[Remark]:
    """Find moving edges that are exactly planar while a moving edge above them is not."""
    tilts: dict[str, float] = {}  # of the frames by the edges above them
    for edge in case.downward:
        above = tilts.get(edge.parent, 0.0)
        motion = edge.moving.motion if edge.moving is not None else None
        tilts[edge.child] = max(above, motion.tilt if motion is not None else 0.0)
        if motion is not None and motion.planar and motion.moved and above > _TILTED:
            yield of_edge(edge, 'has roll and pitch exactly zero, below an edge that tilts by '
                          f'{degrees(above):.1f} deg', {'tilt_deg': degrees(above)})
