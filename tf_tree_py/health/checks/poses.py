# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the poses of edges: jumps, and what should be static, constant or planar."""

from collections.abc import Collection, Iterator
from math import degrees

from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds

from .case import Case
from .finding import check, Number, of_edge, Remark, Severity, times
from ..measures.edge_record import Edge, EdgeRecord, MovingEdge
from ..measures.motion import Jump

# With fewer steps than this, their median is not reliable.
_SEVERAL = 20
# Metres: a joint that rotates travels less.
_IN_PLACE = 1e-3
# Metres: a robot that drives goes further, a wheel turns in place.
_DRIVEN = 0.1
# Of what turns steadily, one step of four is slower than this part of the usual one.
_STEADY = 0.6
# A correction that takes longer is sent too rarely, nanoseconds.
_RARELY = from_seconds(0.5)


@check(Severity.WARNING,
       explains=('interpolated_jump',),
       catches='a step between two samples that is faster than any real motion',
       cause='an estimator that was reset or corrected, such as by the loop closure of a SLAM, '
             'an encoder that wrapped around, or an outlier that was not filtered',
       fix='check its publisher at that stamp; --max-speed and --max-turn-rate set the limits of '
           'motion')
def pose_jump(case: Case) -> Iterator[Remark]:
    """Find steps faster than the limits; those of a localiser get a cause of their own."""
    for edge, moving in case.moving():
        jump = moving.motion.fast
        if not moving.motion.is_rare(jump) or _rests(case, edge, moving):
            continue
        seconds = jump.time / 1e9
        evidence = _evidence(jump) | {
            'speed_m_s': jump.gone / seconds, 'turn_rate_deg_s': degrees(jump.turned) / seconds}
        yield of_edge(edge, _in_words(jump), evidence, **_of_localiser(case, edge))


@check(Severity.WARNING,
       explains=('pose_jump', 'interpolated_jump'),
       catches='single samples that are far from those before and after them',
       cause='a sensor that returns zero or garbage now and then, a filter that was reset for '
             'one cycle, or a second node that also sends this edge, but rarely',
       fix='let its publisher omit such samples: a lookup at that moment returns the wrong pose. '
           'If several nodes send this edge, stop all but one')
def outlier(case: Case) -> Iterator[Remark]:
    """Find steps faster than the limits that the next step reverses."""
    for edge, moving in case.moving():
        jump = moving.motion.outliers
        if moving.motion.is_rare(jump):
            yield of_edge(
                edge, f'has {jump.count} of {moving.timing.count} samples that are far from those '
                f'beside them, at most by {jump.gone:.3g} m and {degrees(jump.turned):.3g} deg, '
                f'after {format_stamp(jump.stamp)} s',
                _evidence(jump) | {'samples': moving.timing.count})


@check(Severity.WARNING,
       explains=('pose_jump', 'interpolated_jump', 'outlier'),
       catches='an edge that is always faster than any real motion',
       cause='millimetres sent as metres, degrees sent as radians, or stamps in another unit',
       fix='check the units of its publisher; --max-speed and --max-turn-rate set the limits of '
           'motion')
def too_fast(case: Case) -> Iterator[Remark]:
    """Find edges whose usual step is faster than the limits."""
    limits = case.limits
    for edge, moving in case.moving():
        speed, turn_rate = moving.motion.speeds, moving.motion.turn_rates
        if speed.count >= _SEVERAL and (speed.median > limits.max_usual_speed
                                        or turn_rate.median > limits.max_usual_turn_rate):
            (usual, fast), (turns, fast_turns) = speed.at(0.5, 0.95), turn_rate.at(0.5, 0.95)
            yield of_edge(
                edge, f'moves at {usual:.3g} m/s and {turns:.3g} rad/s (5 of 100 steps at more '
                f'than {fast:.3g} m/s or {fast_turns:.3g} rad/s)',
                {'p50_speed_m_s': usual, 'p95_speed_m_s': fast,
                 'p50_turn_rate_deg_s': degrees(turns),
                 'p95_turn_rate_deg_s': degrees(fast_turns)},
                **_ROTOR if _is_rotor(moving) else {})


_ROTOR: dict[str, object] = {
    'severity': Severity.NOTE,
    'cause': 'a rotor or a wheel that turns by a large part of a turn from one sample to the '
             'next: then these samples do not show how fast it turns; or degrees sent as radians',
    'fix': 'nothing to do if it is a rotor. If it is a joint, check the unit: /joint_states has '
           'radians'}


def _is_rotor(moving: MovingEdge) -> bool:
    """Return whether an edge turns in place, and steadily, unlike a joint."""
    slow, usual = moving.motion.turn_rates.at(0.25, 0.5)
    return moving.motion.travelled < _IN_PLACE and slow > _STEADY * usual


@check(Severity.WARNING, textbook=True,
       catches='a jump between two samples that are far apart in time',
       cause='an edge that is corrected in one step, such as by a slow localiser, or one that is '
             'sent too rarely for its motion',
       fix='send it more often, even while it does not change: lookups between the two samples '
           'return interpolated poses that never existed')
def interpolated_jump(case: Case) -> Iterator[Remark]:
    """Find large steps that take long, with the edge almost at rest before and after."""
    for edge, moving in case.moving():
        jump = moving.motion.slow
        # A wheel may turn by more than half a turn from one sample to the next.
        in_place = moving.motion.travelled < _IN_PLACE
        if (not in_place and moving.motion.is_rare(jump)
                and not _rests(case, edge, moving)):
            yield of_edge(edge, f'{_in_words(jump)}: lookups in between return poses that never '
                          'existed', _evidence(jump),
                          **_of_localiser(case, edge) if jump.time < _RARELY else {})


# An edge rests if it makes at most this many steps among at least the second number.
_ONCE, _AT_REST = 3, 20


@check(Severity.NOTE,
       catches='an edge that rests, and moved once in one step',
       cause='a mounting or a calibration that is sent on /tf and changed, such as after '
             'a restart with other parameters; or a joint that was set in one step',
       fix='if it is a mounting, find out who changed it: data from before the step needs the old '
           'value. A joint that was set needs nothing')
def moved_once(case: Case) -> Iterator[Remark]:
    """Find edges that rest except for a few steps, unless they are a localiser's corrections."""
    for edge, moving in case.moving():
        motion = moving.motion
        step = motion.lone
        if not _rests(case, edge, moving):
            continue
        # A joint turns about its origin, or slides, at a speed; what is mounted anew does not. But
        # what is below a map may be a goal.
        remounted = step.gone > _IN_PLACE and not case.is_fixed(edge.parent) and (
            step.turned > _IN_PLACE or bool(motion.fast.count or motion.slow.count))
        yield of_edge(
            edge, f'rests, but moved {times(step.count)}, by {step.gone:.3g} m and '
            f'{degrees(step.turned):.3g} deg'
            f'{"" if step.count == 1 else " at most"}, after {format_stamp(step.stamp)} s',
            _evidence(step), severity=Severity.WARNING if remounted else None)


def _rests(case: Case, edge: EdgeRecord, moving: MovingEdge) -> bool:
    """Return whether an edge rests except for a few steps that are no corrections."""
    motion = moving.motion
    return (0 < motion.lone.count <= _ONCE and motion.steps >= _AT_REST
            and not case.is_correction(edge))


def _may_be_a_robot(case: Case, edge: EdgeRecord, moving: MovingEdge) -> bool:
    return moving.motion.travelled > _DRIVEN or not case.has_no_children(edge)


def _in_words(jump: Jump) -> str:
    return (f'jumped {times(jump.count)}, at most by {jump.gone:.3g} m and '
            f'{degrees(jump.turned):.3g} deg in {format_span(jump.time)} after '
            f'{format_stamp(jump.stamp)} s')


def _evidence(jump: Jump) -> dict[str, Number]:
    return {'count': jump.count, 'after_stamp_s': jump.stamp / 1e9, 'time_s': jump.time / 1e9,
            'gone_m': jump.gone, 'turned_deg': degrees(jump.turned)}


def _of_localiser(case: Case, edge: EdgeRecord) -> dict[str, object]:
    # Odometry, too, may be slower than the wheels, which are all that is below it.
    if not (case.is_correction(edge) and any(
            below.parent == edge.child and _may_be_a_robot(case, below, moving)
            for below, moving in case.moving())):
        return {}
    return {'severity': Severity.NOTE,
            'cause': 'a correction of the localiser, which may jump: the edge below it moves '
                     'smoothly',
            'fix': f'plan and control in {edge.child}; only goals belong in {edge.parent}'}


# --- what should not move, or should

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
        if edge.fixed is None:
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
