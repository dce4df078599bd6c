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

"""How often an edge is sent, and how old it is when it is used."""

from collections.abc import Iterator

from .case import Case
from .check import check, of_edge, Remark
from .finding import Severity
from ..stamp import format_span, format_stamp, from_seconds
from ..vitals.edge import EdgeRecord, MovingEdge

# An edge, and how old its newest sample may be, nanoseconds.
_Aged = tuple[float, EdgeRecord]

# A gap is a silence of this many usual intervals, and at least this long.
_MISSED = 10.0
_SILENCE = from_seconds(0.5)
# With fewer intervals than this, regularity is not judged.
_SEVERAL = 20
# The middle 80 of 100 intervals of a regular edge differ by less than this part of the usual.
_JITTER = 1.2


@check(Severity.WARNING, explains=('skew', 'irregular_rate', 'interpolated_jump', 'pose_jump'),
       catches='an edge that was silent for long, or has ended',
       cause='its node hung, crashed or was restarted, or the network broke',
       fix='look at the log of its publisher at that time: lookups in the gap are interpolated '
           'across it, and those behind the end fail')
def gap(case: Case) -> Iterator[Remark]:
    """Find the longest silence of each edge, if it is too long for its rate."""
    for edge, moving in case.moving():
        timing = moving.timing
        usual = timing.interval
        if not usual:
            continue
        least = max(_SILENCE, _MISSED * usual)
        longest, ended = timing.intervals.most, case.now - timing.last
        evidence = {'longest_s': longest / 1e9, 'usual_s': usual / 1e9}
        if longest > least:
            yield of_edge(
                edge, f'was silent for {format_span(round(longest))} after '
                f'{format_stamp(timing.longest)} s; usually it comes every '
                f'{format_span(round(usual))}', evidence | {'after_stamp_s': timing.longest / 1e9})
        elif ended > least:
            yield of_edge(
                edge, f'ended {format_span(ended)} before the others; it came every '
                f'{format_span(round(usual))}', evidence | {'ended_s': ended / 1e9})


@check(Severity.WARNING,
       catches='an edge whose samples come in fits and starts',
       cause='a timer that is starved, a driver that sends in bursts, or one that stamps when it '
             'sends and not when it measures',
       fix='stamp with the time of the measurement, and publish from a timer that is not blocked')
def irregular_rate(case: Case) -> Iterator[Remark]:
    """Find edges most of whose intervals differ widely."""
    for edge, moving in case.moving():
        intervals = moving.timing.intervals
        if intervals.count < _SEVERAL:
            continue
        short, usual, long = intervals.at(0.1, 0.5, 0.9)
        if long - short > _JITTER * usual:
            yield of_edge(
                edge, f'comes irregularly: 80 of 100 intervals are between '
                f'{format_span(round(short))} and {format_span(round(long))}',
                {'p10_interval_s': short / 1e9, 'p50_interval_s': usual / 1e9,
                 'p90_interval_s': long / 1e9})


@check(Severity.WARNING, explains=('skew', 'gap', 'irregular_rate', 'interpolated_jump'),
       catches='an edge so slow that a buffer never holds two samples of it',
       cause='it is sent at a rate of its own that has nothing to do with the window of buffers',
       fix='send it more often, or, if it never changes, once on /tf_static; or give buffers a '
           'longer cache_time')
def slow_for_window(case: Case) -> Iterator[Remark]:
    """Find edges that come less often than once in a window."""
    window = case.limits.cache_time
    for edge, moving in case.moving():
        timing = moving.timing
        interval = timing.span / (timing.count - 1) if timing.count > 1 else (
            case.now - timing.last)
        if interval > window:
            yield of_edge(
                edge, f'comes every {interval / 1e9:.1f} s, and buffers keep '
                f'{window / 1e9:.1f} s: only a lookup for the very stamp is answered',
                {'interval_s': interval / 1e9, 'window_s': window / 1e9})


@check(Severity.WARNING,
       catches='edges on one path of which one is much older than another when it is used',
       cause='one of them is sent seldom, and the latest that all of them have is as old as its '
             'last sample',
       fix='send the slow one more often; lookups for a stamp have to wait for it')
def skew(case: Case) -> Iterator[Remark]:
    """Find edges that are much older than another edge above or below them."""
    told = set()
    # Of the edges above each frame: the oldest and the freshest, with their ages.
    extremes: dict[str, tuple[_Aged, _Aged]] = {}
    for edge in case.downward:
        found = extremes.get(edge.parent)
        if edge.moving is not None and edge.moving.timing.delays.count:
            own = _age(case, edge.moving), edge
            found = (own, own) if found is None else (
                max(found[0], own, key=_first), min(found[1], own, key=_first))
        if found is None:
            continue
        extremes[edge.child] = found
        (age, oldest), (least, freshest) = found
        if age - least > case.limits.max_skew and oldest.frames not in told:
            told.add(oldest.frames)
            yield _older(oldest, freshest, age - least)


def _first(aged: _Aged) -> float:
    return aged[0]


def _age(case: Case, moving: MovingEdge) -> float:
    """Return how old the newest sample usually is just before the next one; 0 if post-dated."""
    return max(0.0, moving.timing.delays.median - case.offset + moving.timing.interval)


def _older(edge: EdgeRecord, other: EdgeRecord, apart: float) -> Remark:
    return of_edge(edge, f'is up to {apart / 1e9:.2f} s older than {other}, on the same path: '
                   'the latest transform through both is that old', {'apart_s': apart / 1e9})
