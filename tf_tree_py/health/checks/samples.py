# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the samples of an edge: their numbers, their stamps, their steps, and static ones."""

from collections.abc import Iterator
from math import degrees
from typing import Any

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_edge, of_trouble, Remark
from .finding import Number, Severity
from ..measures.edge_record import EdgeRecord
from ..measures.motion import Jump


@check(Severity.ERROR,
       catches='NaN or infinity in a transform',
       cause='a division by zero, or a filter that has diverged, in the node that sends it',
       fix='fix the publisher; every buffer refuses such a transform, so the edge does not move')
def not_finite(case: Case) -> Iterator[Remark]:
    """Find transforms that the buffer refused because of NaN or infinity."""
    for edge, trouble in case.of_kind(Kind.NOT_FINITE):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} was NaN or infinite '
                         f'{times(trouble.count)}', trouble)


@check(Severity.WARNING,
       catches='quaternions whose length is not one',
       cause='averaging or integrating quaternions without normalising them; or Euler angles in '
             'the fields of a quaternion',
       fix='normalise before sending: each buffer does so too, but not every consumer')
def not_normalised(case: Case) -> Iterator[Remark]:
    """Find quaternions whose length is not one; the buffer refuses those of length zero."""
    for edge, moving in case.moving():
        motion = moving.motion
        if motion.off_length:
            yield of_edge(
                edge, f'has quaternions of length {motion.worst_length:.4g}, {motion.off_length} '
                f'of {moving.timing.count}',
                {'count': motion.off_length, 'samples': moving.timing.count,
                 'worst_length': motion.worst_length})
    for frames, trouble in case.of_kind(Kind.ZERO_ROTATION):
        yield of_trouble(
            frames, f'{frames[0]} -> {frames[1]} has an all-zero quaternion, and was refused '
            f'{times(trouble.count)}', trouble, evidence={'worst_length': 0.0},
            severity=Severity.ERROR, cause='a message whose rotation was not set',
            fix='for no rotation send x 0, y 0, z 0, w 1')


@check(Severity.ERROR,
       catches='messages that cannot be read, and invalid frame names',
       cause='a different message type on the topic, a damaged recording, or a name from '
             'uninitialised memory',
       fix='check the publisher that the evidence names, and the messages that it sends')
def unreadable(case: Case) -> Iterator[Remark]:
    """Find messages and names that the buffer refused."""
    for frames, trouble in case.of_kind(Kind.MALFORMED, Kind.BAD_NAME, Kind.TOO_MANY_FRAMES):
        yield of_trouble(tuple(filter(None, frames)),
                         f'refused {times(trouble.count)}: {trouble.detail}', trouble)


# --- the order of stamps

# Fewer cases than this are not reported.
_FEW = 3
_SELDOM = 0.01


@check(Severity.ERROR,
       catches='moving transforms whose stamp is zero',
       cause='a message whose header.stamp was not set, or a node with use_sim_time before the '
             'first /clock',
       fix='stamp it with the time of the data that it comes from')
def zero_stamps(case: Case) -> Iterator[Remark]:
    """Find moving edges with zero stamps; the stamps of static edges have no meaning."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.zeros:
            yield of_edge(edge, f'has {timing.zeros} of {timing.count} stamps that are zero',
                          {'count': timing.zeros, 'samples': timing.count})


@check(Severity.WARNING,
       catches='stamps that jump back and continue from there',
       cause='a recording that is played in a loop, a simulation that was restarted, or a clock '
             'that was set back',
       fix='publish /clock and set use_sim_time, or pass Buffer(clear_on_jump_back=...); '
           'otherwise all later data is refused as too old')
def jump_back(case: Case) -> Iterator[Remark]:
    """Find stamps that went back by more than a second and continued from there."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.jumps:
            yield of_edge(edge, f'jumped back {times(timing.jumps)}, by up to '
                          f'{format_span(timing.back)}',
                          {'count': timing.jumps, 'back_s': timing.back / 1e9})


@check(Severity.WARNING,
       catches='several transforms of one edge with the same stamp',
       cause='a node that publishes its last data at a fixed rate, with the stamp of the data; or '
             'a relay that forwards everything twice',
       fix='send each stamp once; a buffer uses the last of several')
def duplicate_stamps(case: Case) -> Iterator[Remark]:
    """Find edges with many repeated stamps."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.duplicates >= _FEW and timing.duplicates > _SELDOM * timing.count:
            yield of_edge(
                edge, f'repeats {timing.duplicates} of {timing.count} stamps, '
                f'{timing.differing} of them with another pose',
                {'count': timing.duplicates, 'differing': timing.differing,
                 'samples': timing.count})


@check(Severity.WARNING,
       explains=('irregular_rate',),
       catches='stamps that are older than the one before',
       cause='a node with several threads that publish, a relay over a network that reorders, or '
             'two publishers whose clocks differ',
       fix='publish one edge from one thread, in order: otherwise lookups of the latest transform '
           'may go back in time')
def out_of_order(case: Case) -> Iterator[Remark]:
    """Find edges with many stamps that are older than the one before."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.disorders >= _FEW and timing.disorders > _SELDOM * timing.count:
            yield of_edge(edge, f'has {timing.disorders} of {timing.count} stamps that are older '
                          'than the one before',
                          {'count': timing.disorders, 'samples': timing.count})


@check(Severity.WARNING, textbook=True,
       explains=('skew',),
       catches='transforms that arrive long after their stamp',
       cause='a slow node, a queue that is always full, a busy computer or network; or the clock '
             'of its computer is behind',
       fix='find the cause of the delay; until then a lookup for the stamp of data needs a longer '
           'timeout than this',
       recorded_fix='find the cause of the delay before the next recording. In this one the late '
                    'samples are there too: only lookups at its end fail, and stamps_at_rate '
                    'returns stamps for which all edges have data. If the clock was behind, shift '
                    'the stamps of this edge')
def delayed(case: Case) -> Iterator[Remark]:
    """Find edges of which 5 % of the samples arrive later than the limit."""
    for edge, moving in case.moving():
        delays = case.delays.get(edge.frames)
        if delays is None or moving.timing.delays.count < _FEW:
            continue
        # If the clocks differ, the fit between them is too inaccurate for the late quantile.
        judged = delays.usual if case.timebase.differs else delays.late
        if judged > case.limits.max_delay:
            yield of_edge(
                edge, f'arrives {delays.late / 1e6:.0f} ms after its stamp (95 of 100 are '
                f'earlier; usually {delays.usual / 1e6:.0f} ms)',
                {'p50_delay_s': delays.usual / 1e9, 'p95_delay_s': delays.late / 1e9,
                 'count': moving.timing.delays.count})


# --- steps between samples

# With fewer steps than this, their median is not reliable.
_SEVERAL = 20
# Metres: a joint that rotates travels less.
_IN_PLACE = 1e-3


@check(Severity.WARNING,
       explains=('interpolated_jump',),
       catches='a step between two samples that is faster than any real motion',
       cause='an estimator that was reset, an encoder that wrapped around, or an outlier that '
             'was not filtered',
       fix='check its publisher at that stamp; --max-speed and --max-turn-rate set the limits of '
           'motion')
def pose_jump(case: Case) -> Iterator[Remark]:
    """Find steps faster than the limits; those of a localiser get a cause of their own."""
    for edge, moving in case.moving():
        jump = moving.motion.fast
        if not jump.count:
            continue
        seconds = jump.time / 1e9
        evidence = _evidence(jump) | {
            'speed_m_s': jump.gone / seconds, 'turn_rate_deg_s': degrees(jump.turned) / seconds}
        yield of_edge(edge, _in_words(jump), evidence, **_of_localiser(case, edge))


@check(Severity.WARNING,
       explains=('pose_jump', 'interpolated_jump'),
       catches='single samples that are far from those before and after them',
       cause='a sensor that returns zero or garbage now and then, or a filter that was reset for '
             'one cycle',
       fix='let its publisher omit such samples: a lookup at that moment returns the wrong pose')
def outlier(case: Case) -> Iterator[Remark]:
    """Find steps faster than the limits that the next step reverses."""
    for edge, moving in case.moving():
        jump = moving.motion.outliers
        if jump.count:
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
                 'p95_turn_rate_deg_s': degrees(fast_turns)})


@check(Severity.WARNING, textbook=True,
       catches='a jump between two samples that are far apart in time',
       cause='an edge that is sent rarely and corrected in one step, such as a slow localiser',
       fix='send it more often, even while it does not change: lookups between the two samples '
           'return interpolated poses that never existed')
def interpolated_jump(case: Case) -> Iterator[Remark]:
    """Find large steps that take long, with the edge almost at rest before and after."""
    for edge, moving in case.moving():
        jump = moving.motion.slow
        # A wheel may turn by more than half a turn from one sample to the next.
        in_place = moving.motion.travelled < _IN_PLACE and not case.is_correction(edge)
        if jump.count and not in_place:
            yield of_edge(edge, f'{_in_words(jump)}: lookups in between return poses that never '
                          'existed', _evidence(jump))


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
            'cause': 'a correction of the localiser, which may jump: the edge below it moves '
                     'smoothly',
            'fix': f'plan and control in {edge.child}; only goals belong in {edge.parent}'}


# --- static edges

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
       fix='send it once on /tf_static: it is valid at every stamp there, even after its '
           'publisher has ended')
def static_republished(case: Case) -> Iterator[Remark]:
    """Find edges whose pose never changes, even in its last bit, while others move."""
    robot_stands = not any(moving.motion.moved for _, moving in case.moving())
    moved = {edge.frames for edge, moving in case.moving() if moving.motion.moved}
    for edge, moving in case.moving():
        timing = moving.timing
        if moving.motion.moved or timing.count < _MANY or timing.span < _LONG:
            continue
        if robot_stands:
            continue
        # A joint at rest is sent together with moving ones.
        is_joint = any(other in moved for other in moving.beside)
        yield of_edge(
            edge, f'was sent {times(timing.count)} in {timing.span / 1e9:.1f} s, at '
            f'{timing.rate_hz:.1f} Hz, and never changed',
            {'count': timing.count, 'rate_hz': timing.rate_hz, 'span_s': timing.span / 1e9},
            severity=Severity.NOTE if is_joint or _may_rest(case, edge) else None,
            cause='a joint or a localiser at rest; or a calibration that is sent with moving edges'
            if is_joint or _may_rest(case, edge) else '')


def _may_rest(case: Case, edge: EdgeRecord) -> bool:
    # A localiser without anything to correct always sends the same value.
    return case.is_correction(edge)


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
            yield of_edge(
                edge, f'is static and changed {times(fixed.changes)}, by up to '
                f'{fixed.gone:.4g} m and {degrees(fixed.turned):.4g} deg',
                {'changes': fixed.changes, 'gone_m': fixed.gone,
                 'turned_deg': degrees(fixed.turned)})


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
