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

"""Stamps that cannot be right, or that come in the wrong order."""

from collections.abc import Iterator

from .case import Case
from .check import check, of_edge, publishers_of, Remark
from .finding import Severity
from ..stamp import format_span, from_seconds
from ..text import times

# Fewer cases than this are not reported.
_FEW = 3
_SELDOM = 0.01
# Two clocks that chrony keeps may differ by this much.
_AHEAD = from_seconds(0.05)
# A localiser post-dates by this much at most; and by a constant, so its delays differ little.
_POST_DATED, _STEADY = from_seconds(5.0), from_seconds(0.2)
# Further ahead than a buffer's window, one stamp makes all good data too old.
_POISON = from_seconds(10.0)


@check(Severity.ERROR,
       catches='moving transforms whose stamp is zero',
       cause='a message whose header.stamp nobody has set, or a node with use_sim_time before '
             'the first /clock',
       fix='stamp it with the time of the data that it comes from')
def zero_stamps(case: Case) -> Iterator[Remark]:
    """Find moving edges with stamps that are zero; the stamp of a static one means nothing."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.zeros:
            yield of_edge(edge, f'has {timing.zeros} of {timing.count} stamps that are zero',
                          {'count': timing.zeros, 'samples': timing.count})


@check(Severity.ERROR,
       explains=('delayed', 'future_stamps', 'skew', 'gap', 'jump_back', 'out_of_order'),
       catches='stamps of two clocks in one tree: some of the system, some simulated',
       cause='some nodes run with use_sim_time and others without; or the clock of one computer '
             'is far off',
       fix='set use_sim_time for all nodes or for none; on several computers let chrony keep '
           'the clocks')
def clock_mixture(case: Case) -> Iterator[Remark]:
    """Find edges whose stamps come from another clock than those of most edges."""
    for clock in case.clocks[1:]:
        apart = clock.delay - case.clocks[0].delay
        first, more = clock.edges[0], len(clock.edges) - 1
        told = f'{first} and {more} more edges are' if more else f'{first} is'
        frames = dict.fromkeys(frame for edge in clock.edges for frame in edge.frames)
        yield Remark(
            f'{told} stamped {format_span(abs(round(apart)))} '
            f'{"behind" if apart > 0 else "ahead of"} {len(case.clocks[0].edges)} others',
            tuple(frames), publishers_of(*clock.edges),
            {'edges': len(clock.edges), 'apart_s': apart / 1e9})


@check(Severity.WARNING,
       explains=('out_of_order', 'gap', 'delayed', 'future_stamps', 'skew', 'irregular_rate',
                 'duplicate_stamps', 'pose_jump', 'interpolated_jump', 'two_publishers'),
       catches='stamps that jump back and go on from there',
       cause='a recording that is played in a loop, a simulation that was restarted, or a clock '
             'that was set back',
       fix='let /clock be published and set use_sim_time, or pass '
           'Buffer(clear_on_jump_back=...); else all that follows is refused as too old')
def jump_back(case: Case) -> Iterator[Remark]:
    """Find stamps that went back by more than a second and stayed there."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.jumps:
            yield of_edge(edge, f'jumped back {times(timing.jumps)}, by up to '
                          f'{format_span(timing.back)}',
                          {'count': timing.jumps, 'back_s': timing.back / 1e9})


@check(Severity.WARNING,
       catches='several transforms of one edge with the same stamp',
       cause='a node that sends at a rate of its own what it has, with the stamp of the data; or '
             'a relay that passes everything on twice',
       fix='send each stamp once; of several a buffer uses the last')
def duplicate_stamps(case: Case) -> Iterator[Remark]:
    """Find edges with many stamps that came before."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.duplicates >= _FEW and timing.duplicates > _SELDOM * timing.count:
            yield of_edge(
                edge, f'has {timing.duplicates} of {timing.count} stamps that came before, '
                f'{timing.differing} of them with another pose',
                {'count': timing.duplicates, 'differing': timing.differing,
                 'samples': timing.count})


@check(Severity.WARNING, explains=('irregular_rate',),
       catches='stamps that are older than the one before',
       cause='a node with several threads that publish, a relay over a network that reorders, or '
             'two publishers whose clocks differ',
       fix='publish one edge from one thread, in order: who asks for the latest in between gets '
           'an older answer than before')
def out_of_order(case: Case) -> Iterator[Remark]:
    """Find edges with many stamps that are older than the one before."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.disorders >= _FEW and timing.disorders > _SELDOM * timing.count:
            yield of_edge(edge, f'has {timing.disorders} of {timing.count} stamps that are older '
                          'than the one before',
                          {'count': timing.disorders, 'samples': timing.count})


@check(Severity.WARNING, textbook=True, explains=('skew',),
       catches='transforms that arrive long after their stamp',
       cause='a slow node, a queue that is always full, a busy computer or network; or the clock '
             'of its computer is behind',
       fix='find where the time goes; until then a lookup for the stamp of data needs a timeout '
           'of more than this')
def delayed(case: Case) -> Iterator[Remark]:
    """Find edges of which 5 of 100 samples arrive later than the limit."""
    for edge, moving in case.moving():
        if moving.timing.delays.count < _FEW:
            continue
        median, late = (delay - case.offset for delay in moving.timing.delays.at(0.5, 0.95))
        # Another clock may go at another pace: then only the usual delay can be compared.
        judged = median if case.offset else late
        if judged > case.limits.max_delay and case.goes_by_main_clock(edge):
            yield of_edge(
                edge, f'arrives {late / 1e6:.0f} ms after its stamp (95 of 100 are earlier; '
                f'usually {median / 1e6:.0f} ms)',
                {'p50_delay_s': median / 1e9, 'p95_delay_s': late / 1e9,
                 'count': moving.timing.delays.count})


@check(Severity.WARNING, explains=('skew',),
       catches='stamps that are ahead of the clock',
       cause="the clock of the sender's computer is ahead (chrony or NTP set it)",
       fix='set the clocks; Buffer(max_future=...) refuses what is further ahead than that')
def future_stamps(case: Case) -> Iterator[Remark]:
    """Find edges whose stamps usually lie ahead, and single stamps that lie far ahead."""
    for edge, moving in case.moving():
        delays = moving.timing.delays
        if not delays.count or not case.goes_by_main_clock(edge):
            continue
        early, median, late = (delay - case.offset for delay in delays.at(0.05, 0.5, 0.95))
        furthest = case.offset - delays.least
        evidence = {'usually_s': -median / 1e9, 'furthest_s': furthest / 1e9}
        # Another clock may go at another pace: then nothing can be said of single stamps.
        if furthest > _POISON and not case.offset:
            yield of_edge(edge, f'has stamps up to {furthest / 1e9:.1f} s ahead of the clock: '
                          'good data of it is refused until the clock gets there', evidence,
                          severity=Severity.ERROR)
        elif -median > _AHEAD:
            harmless = (case.is_correction(edge) and -median < _POST_DATED
                        and late - early < _STEADY)
            yield of_edge(
                edge, f'is stamped {-median / 1e6:.0f} ms ahead of the clock', evidence,
                severity=Severity.NOTE if harmless else None,
                cause='a localiser that post-dates by a constant, on purpose' if harmless else '',
                fix='nothing; max_future, where it is used, has to be more' if harmless else '')
