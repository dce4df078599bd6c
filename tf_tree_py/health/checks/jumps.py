# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the steps between the samples of an edge."""

from collections.abc import Iterator
from math import degrees

from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_edge, Remark
from .finding import Number, Severity
from ..measures.edge_record import EdgeRecord, MovingEdge
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
        if not (jump.count and moving.motion.is_rare(jump)) or _rests(case, edge, moving):
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
        if jump.count and moving.motion.is_rare(jump):
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
        in_place = moving.motion.travelled < _IN_PLACE and not case.is_correction(edge)
        if (jump.count and not in_place and moving.motion.is_rare(jump)
                and not _rests(case, edge, moving)):
            yield of_edge(edge, f'{_in_words(jump)}: lookups in between return poses that never '
                          'existed', _evidence(jump),
                          **_of_localiser(case, edge) if jump.time < _RARELY else {})


# An edge rests if it makes at most this many steps among at least the second number.
_ONCE, _RESTS = 3, 20


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
    return (0 < motion.lone.count <= _ONCE and motion.steps >= _RESTS
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
