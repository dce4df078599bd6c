# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the samples of an edge: their numbers, and the order of their stamps."""

from collections.abc import Iterator

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.stamp import format_span, format_stamp
from tf_tree_py.core.text import times

from .case import Case
from .check import check, of_edge, of_trouble, Remark
from .finding import Severity


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


@check(Severity.ERROR,
       explains=('gap', 'irregular_rate'),
       catches='a stamp whose nanosec is a second or more',
       cause='a driver that computes nanosec wrongly: it subtracts below zero, or puts all '
             'microseconds since 1970 there; both wrap at 2^32',
       fix='fix the publisher: nanosec has the part below a second, from 0 to 999999999. A buffer '
           'of this package refuses such a transform; tf2 inserts it up to four seconds away')
def impossible_stamp(case: Case) -> Iterator[Remark]:
    """Find moving transforms that the buffer refused because of their nanosec."""
    for edge, trouble in case.of_kind(Kind.IMPOSSIBLE_STAMP):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} has an impossible stamp '
                         f'{times(trouble.count)}; the first: {trouble.detail}', trouble)


# --- the order of stamps

# Fewer cases than this are not reported.
_FEW = 3
_SELDOM = 0.01
# Of stamps that are late and rounded, up to a quarter are usually repeated; that does no harm.
_LOST = 0.4


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
       explains=('gap', 'jump_back', 'out_of_order', 'delayed', 'skew'),
       catches='single samples with a stamp that is far older than those around it',
       cause='a message that was stamped before the clock of its computer was set, or with a '
             'variable that was not',
       fix='let its publisher stamp it with the time of the data: a buffer that has no newer data '
           'of the edge interpolates from that stamp on',
       recorded_fix='leave it out: open_bag lists it among its oddities, with the options that do '
                    'so. Lookups between it and the others are interpolated over that time')
def lone_stamp(case: Case) -> Iterator[Remark]:
    """Find edges with a few samples whose stamps are at least a minute too old."""
    for edge, moving in case.moving():
        if moving.first_lone is None:
            continue
        received, stamps = moving.first_lone.received, moving.first_lone.stamps
        behind = int(stamps[1] - stamps[0])
        yield of_edge(
            edge, f'has {moving.lone} of {moving.timing.count} samples with a stamp far older '
            f'than the others, first {format_stamp(int(stamps[0]))} s, received at '
            f'{format_stamp(int(received[0]))} s: {format_span(behind)} before the next stamp',
            {'count': moving.lone, 'samples': moving.timing.count, 'stamp_s': stamps[0] / 1e9,
             'received_s': received[0] / 1e9, 'behind_s': behind / 1e9})


@check(Severity.WARNING,
       catches='stamps that jump back and continue from there',
       cause='a recording that is played in a loop, a simulation that was restarted, or a clock '
             'that was set back',
       fix='publish /clock and set use_sim_time; or, if all edges jumped back, pass '
           'Buffer(clear_on_jump_back=...). With neither, all later data is refused as too old')
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
                 'samples': timing.count},
                severity=None if timing.differing > _LOST * timing.count else Severity.NOTE)


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
