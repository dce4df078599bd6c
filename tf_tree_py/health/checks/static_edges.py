# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of static edges, of edges that should be, and of planar ones."""

from collections.abc import Collection, Iterator
from math import degrees

from tf_tree_py.core.stamp import format_span, from_seconds
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_edge, Remark
from .finding import Severity
from ..measures.edge_record import Edge, EdgeRecord, MovingEdge

# An edge that has not moved for this long, in this many samples, is considered fixed.
_LONG = from_seconds(4.0)
_MANY = 20
# Radians: half a degree.
_TILTED = 0.009
# Metres: a sliding joint travels less far than a driving robot.
_TRAVELLED = 0.5
# A static edge that arrived this much later than the others was missing when they were used.
_LATE = from_seconds(3.0)


@check(Severity.WARNING, textbook=True,
       explains=('slow_for_window', 'skew'),
       catches='an edge that is sent repeatedly on /tf and never changes',
       cause='a calibration or a fixed joint that is published like a moving edge',
       fix='if it is fixed, send it once on /tf_static: it is valid at every stamp there, even '
           'after its publisher has ended. A joint at rest needs nothing')
def static_republished(case: Case) -> Iterator[Remark]:
    """Find edges whose pose never changes, even in its last bit, while others move."""
    moved = {edge.frames for edge, moving in case.moving() if moving.motion.moved}
    for edge, moving in case.moving() if moved else ():
        timing = moving.timing
        if moving.motion.moved or timing.count < _MANY or timing.span < _LONG:
            continue
        # A robot that stands, a localiser without anything to correct, and a goal do not move.
        may_rest = case.is_fixed(edge.parent) or _is_joint(edge, moving, moved)
        yield of_edge(
            edge, f'was sent {times(timing.count)} in {timing.span / 1e9:.1f} s, at '
            f'{timing.rate_hz:.1f} Hz, and never changed',
            {'count': timing.count, 'rate_hz': timing.rate_hz, 'span_s': timing.span / 1e9},
            **_RESTS if may_rest else {})


_RESTS: dict[str, object] = {
    'severity': Severity.NOTE,
    'cause': 'a joint, a robot or a localiser at rest; or a calibration that is sent like them',
    'fix': 'nothing to do, if it can move; if not, send it once on /tf_static'}


def _is_joint(edge: EdgeRecord, moving: MovingEdge, moved: Collection[Edge]) -> bool:
    """Return whether an edge is sent with moving ones, or with the next one of its chain."""
    return any(other in moved or other[1] == edge.parent or other[0] == edge.child
               for other in moving.beside)


@check(Severity.WARNING, textbook=True,
       catches='a static transform that was sent again with another value',
       cause='a calibration that changed while the system ran, or two files with different '
             'values',
       fix='keep it in one place. Programs that used the old value must be notified: a buffer has '
           'only the newest value, also for old stamps')
def static_changed(case: Case) -> Iterator[Remark]:
    """Find static edges whose value changed."""
    for edge in case.edges:
        fixed = edge.fixed
        if fixed is not None and fixed.changes:
            at_once = fixed.at_once == fixed.changes
            happened = 'came with different values at once' if at_once else 'changed'
            yield of_edge(
                edge, f'is static and {happened} {times(fixed.changes)}, by up to '
                f'{fixed.gone:.4g} m and {degrees(fixed.turned):.4g} deg',
                {'changes': fixed.changes, 'gone_m': fixed.gone,
                 'turned_deg': degrees(fixed.turned)}, **_TWO_VALUES if at_once else {})


_TWO_VALUES: dict[str, object] = {
    'cause': 'two nodes send it, such as robot_state_publisher and a static_transform_publisher; '
             'or one node keeps an old value for those who join late, and sends it with the new',
    'fix': 'send it from one node, with one value: which value counts depends on which message '
           'comes last, and may differ in each process'}


@check(Severity.NOTE,
       catches='a static edge that arrived long after its parent or its children',
       cause='a node that was started later, or a recorder that discovered it late',
       fix='start it earlier, or look up with a timeout: lookups through it fail until it arrives',
       recorded_fix='nothing to do: open_bag makes it valid at all stamps')
def static_late(case: Case) -> Iterator[Remark]:
    """Find static edges that arrived long after an edge that they connect to."""
    first = case.first_arrivals
    for edge in case.edges:
        if edge.fixed is None or not edge.fixed.first:
            continue
        known = [first[frame] for frame in edge.frames if frame in first]
        late = edge.fixed.first - min(known, default=edge.fixed.first)
        if late > _LATE:
            yield of_edge(edge, f'is static and arrived {format_span(late)} after it could first '
                          'have been used', {'late_s': late / 1e9})


@check(Severity.ERROR,
       catches='an edge that is sent both as static and as moving',
       cause='two nodes send it, such as a URDF with a fixed joint and a driver',
       fix='stop one of them: with each change of kind a buffer removes what it had stored')
def kind_flips(case: Case) -> Iterator[Remark]:
    """Find edges that arrived on both kinds of topic."""
    for edge in case.edges:
        if edge.fixed is not None and edge.moving is not None:
            count = edge.moving.timing.count
            yield of_edge(
                edge, f'came {times(edge.fixed.count)} as static and {times(count)} as moving',
                {'static': edge.fixed.count, 'moving': count})


@check(Severity.NOTE, textbook=True,
       catches='an edge whose roll and pitch are exactly zero, below an edge that tilts',
       cause='a planar odometry or localiser on a robot that does tilt',
       fix='keep the tree three-dimensional, and project last: a point at height h is wrong by '
           'h sin(tilt)')
def planar_only(case: Case) -> Iterator[Remark]:
    """Find moving edges that are exactly planar while a moving edge above them is not."""
    tilts: dict[str, float] = {}  # the largest tilt of the edges above each frame
    for edge in case.downward:
        above = tilts.get(edge.parent, 0.0)
        motion = edge.moving.motion if edge.moving is not None else None
        tilts[edge.child] = max(above, motion.tilt if motion is not None else 0.0)
        # A joint rotates in place; an edge that is planar by mistake also travels.
        if (motion is not None and motion.planar and motion.travelled > _TRAVELLED
                and above > _TILTED):
            yield of_edge(edge, 'has roll and pitch exactly zero, below an edge that tilts by '
                          f'{degrees(above):.1f} deg', {'tilt_deg': degrees(above)})
