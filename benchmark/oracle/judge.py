# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the drives of one setting show, and the bound that each number has to meet."""

from collections.abc import Callable, Iterable, Iterator, Sequence
import math
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binom, t

from .drive import AGREEING, AHEAD, DRIVE, JUMPING, LIMITS, off, PERIOD, Record
from .localiser import Seen
from .robot import Array, Motion, motion_of

# A pose is right if it is less off than this, and stays so for some seconds.
RIGHT_M, RIGHT_RAD, RIGHT_S = 0.2, 0.1, 2.0
# An estimate that is more off than this has been misled by outliers that agree.
MISLED_M = 0.5
# How long a published edge may take, relative to a blend to a goal without noise.
_LONGER = 1.5
# The seconds of a drive in which nothing but the usual happens.
_USUAL = ((8.0, 20.0), (52.0, 64.0))
# The part of good sightings that the gate refuses.
_REFUSED = 0.001
_PERIOD_S = PERIOD * 1e-9
# How long a reader waits for the first sample that is published after a change.
_AHEAD_S = AHEAD * 1e-9 + _PERIOD_S
_ROUNDING = 1e-9


class Row(NamedTuple):
    """
    One number, and what it must be.

    :ivar good: whether it is so.
    """

    name: str
    value: str
    must: str
    good: bool


class Drives(NamedTuple):
    """The records of each story, of all seeds."""

    usual: Sequence[Record]
    agreeing: Sequence[Record]
    jumping: Sequence[Record]


def rows_of(drives: Drives) -> list[Row]:
    """Return the rows of a setting."""
    return [*consistency(drives.usual), *_gate(drives.usual),
            *_motion([*drives.usual, *drives.agreeing]), *_answers(drives),
            *_recoveries(drives), *_misled(drives.agreeing)]


# --- covariances

def consistency(drives: Sequence[Record]) -> Iterator[Row]:
    """Return the rows of the covariances: whether they have the size of the errors."""
    # Of DRIVE.judged. At the last one, a published pose may still be metres off.
    for name, which, instants in (
            ('estimate', 'estimate', (0, 2, 3)),
            ('`lookup_uncertain` of the camera', 'lookup', (0, 2)),
            ('the same, after 20 s without sightings', 'lookup', (1,))):
        # The instants of one drive have its scale and its mounting in common: drives have nothing.
        means = np.array([np.mean([getattr(one.judged[instant], which) for instant in instants])
                          for one in drives])
        mean = means.mean()
        error = t.ppf(0.975, len(means) - 1) * means.std(ddof=1) / math.sqrt(len(means))
        yield Row(f'NEES: {name}', f'{mean:.2f}', f'{1.0 - error:.2f} to {1.0 + error:.2f}',
                  bool(abs(mean - 1.0) <= error))


# --- the published edge

def _motion(records: Sequence[Record]) -> Iterator[Row]:
    speeds, turns, seen = (np.concatenate(parts) for parts in zip(
        *(_rates(one) for one in records), strict=True))
    most, turn = LIMITS.max_speed, LIMITS.max_turn_rate
    yield _at_most('largest speed of the edge at the robot, m/s', speeds.max(), most, '.3f')
    yield _at_most('largest step there in 20 ms, mm', 1e3 * _PERIOD_S * speeds.max(),
                   1e3 * _PERIOD_S * most, '.2f')
    yield _at_most('largest turn rate of the edge, rad/s', turns.max(), turn, '.3f')
    yield _at_most('speed that it adds to what a reader sees, m/s', seen.max(), most, '.3f')


def _answers(drives: Drives) -> Iterator[Row]:
    asked, differ = np.sum([one.answers for records in drives for one in records], axis=0).tolist()
    yield Row('lookups whose answer changed later', f'{differ} of {asked:,}', '0', differ == 0)


def _rates(record: Record) -> tuple[Array, Array, Array]:
    """
    Return the speeds and turn rates of the published edge, and the speeds that a reader sees.

    The edge turns about the newest known place of the robot. What a turn may add at the place
    before, and at that of the reader's older stamp, is subtracted.
    """
    known = np.isfinite(record.read[:, 0])
    edge, odometry = motion_of(record.published[known]), record.odometry[known]
    places = odometry.positions
    read = odometry.inverse().after(motion_of(record.read[known]))
    newest = np.minimum(np.arange(len(places)) + AHEAD // PERIOD + 2, len(places) - 1)
    lever = np.linalg.norm(places[newest] - places, axis=1)[:-1]
    way = np.linalg.norm(np.diff(places, axis=0), axis=1)
    turn = LIMITS.max_turn_rate
    return (np.maximum(_speeds(edge, places[1:]), _speeds(edge, places[:-1]) - turn * way),
            (edge.rotations[:-1].inv() * edge.rotations[1:]).magnitude() / _PERIOD_S,
            _speeds(read, places[:-1]) - turn * lever)


def _speeds(edge: Motion, places: Array) -> Array:
    """Return how fast an edge moves places (N - 1, 3) from one sample to the next."""
    return np.asarray(np.linalg.norm(edge[1:].apply(places) - edge[:-1].apply(places), axis=1)
                      / _PERIOD_S)


# --- the gate

def _gate(drives: Sequence[Record]) -> Iterator[Row]:
    usual = [(seen, verdict) for one in drives for seen, verdict in one.verdicts
             if seen.first and any(begin <= seen.stamp * 1e-9 < end for begin, end in _USUAL)]
    accepted = [verdict.accepted for seen, verdict in usual if not seen.good]
    refused = [not verdict.accepted for seen, verdict in usual if seen.good]
    yield _share('outliers accepted', accepted, 0)
    most = int(binom.ppf(0.975, len(refused), _REFUSED))
    yield _share('good sightings refused', refused, most)


def _share(name: str, happened: Sequence[bool], most: int) -> Row:
    count, of = sum(happened), len(happened)
    return Row(name, f'{count} of {of:,}', f'{most}', count <= most)


# --- being right again

class Recovery(NamedTuple):
    """
    How a pose became right again, seconds.

    :ivar estimated: until the estimate was right.
    :ivar published: until the published pose was right.
    :ivar believed: until four good sightings in a row had arrived.
    :ivar blend: the duration of one blend from the published pose to the truth.
    """

    estimated: float
    published: float
    believed: float
    blend: float


def _recoveries(drives: Drives) -> Iterator[Row]:
    carried, jumped = DRIVE.carried_at, JUMPING.carried_at
    assert carried is not None and jumped is not None
    after = [_recovery(one, DRIVE.outage[1], carried) for one in drives.usual]
    yield _times('outage: estimate right', 'estimated', after, lambda one: one.believed)
    yield _times('outage: published pose right', 'published', after,
                 lambda one: one.believed + _LONGER * one.blend)
    after = [_recovery(one, carried) for one in drives.usual]
    yield _times('kidnapping: estimate right', 'estimated', after, lambda one: one.believed)
    yield _times('kidnapping: published pose right', 'published', after)
    yield _distances('kidnapping: published pose off', drives.usual, carried, DRIVE.seconds)
    after = [_recovery(one, jumped) for one in drives.jumping]
    yield _times('kidnapping, `jump_above`: published pose right', 'published', after,
                 lambda one: one.believed + _AHEAD_S)
    counts = [_jumps(one) for one in drives.jumping]
    jumps, reports = (sum(parts) for parts in zip(*counts, strict=True))
    yield Row('jumps of the published edge, and jumps that the anchor reported',
              f'{jumps}, {reports}', 'equal', all(steps == verdicts for steps, verdicts in counts))


def _jumps(record: Record) -> tuple[int, int]:
    """Return how many steps of an edge are too fast, and how many jumps the anchor reports."""
    speeds, turns, _ = _rates(record)
    fast = (speeds > LIMITS.max_speed + _ROUNDING) | (turns > LIMITS.max_turn_rate + _ROUNDING)
    return int(fast.sum()), sum(verdict.jump is not None for _, verdict in record.verdicts)


def _recovery(record: Record, begin: float, until: float | None = None) -> Recovery:
    first = round(begin / _PERIOD_S)
    left = off(motion_of(record.read[first]), record.truth[first])
    metres, radians = float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))
    return Recovery(
        _right_after(record.estimated, record.truth, begin, until),
        _right_after(record.read, record.truth, begin, until),
        _four_in_a_row(record.verdicts, begin) + _PERIOD_S,
        LIMITS.over * 0.5e-9 + math.hypot(metres / LIMITS.max_speed,
                                          radians / LIMITS.max_turn_rate))


def _right_after(rows: Array, truth: Motion, begin: float, until: float | None) -> float:
    """Return after how many seconds poses (N, 7) are right for a while."""
    part = slice(round(begin / _PERIOD_S), round(until / _PERIOD_S) if until else None)
    error = off(motion_of(rows[part]), truth[part])
    wrong = ((np.linalg.norm(error[:, :3], axis=1) > RIGHT_M)
             | (np.linalg.norm(error[:, 3:], axis=1) > RIGHT_RAD))
    places = np.flatnonzero(np.concatenate([[True], wrong]))
    lasts = np.diff(np.append(places, len(wrong) + 1)) - 1
    long = np.flatnonzero(lasts >= RIGHT_S / _PERIOD_S)
    return float(places[long[0]] * _PERIOD_S) if len(long) else math.inf


def _four_in_a_row(verdicts: Iterable[tuple[Seen, Any]], begin: float) -> float:
    """Return when the last of four good sightings in a row arrives, seconds after the begin."""
    row = 0
    for seen, _ in verdicts:
        if not seen.first:
            continue
        row = row + 1 if seen.good and seen.stamp * 1e-9 >= begin else 0
        if row == 4:
            return seen.arrival * 1e-9 - begin
    return math.inf


def _times(name: str, which: str, after: Sequence[Recovery],
           allowed: Callable[[Recovery], float] | None = None) -> Row:
    taken = [getattr(one, which) for one in after]
    value = _middle_and_longest(taken)
    if allowed is None:
        return Row(f'{name}, s', value, '-', True)
    most = [allowed(one) for one in after]
    # Of four good sightings in a row, the gate refuses one as often as any other.
    late = int(binom.ppf(0.975, len(after), 4 * _REFUSED))
    good = sum(map(float.__gt__, taken, most)) <= late and max(most) < math.inf
    return Row(f'{name}, s', value, f'{np.median(most):.1f}, {max(most):.1f}', good)


def _middle_and_longest(taken: Sequence[float]) -> str:
    """Return the median and the longest of some times, or how many were never reached."""
    middle, never = float(np.median(taken)), taken.count(math.inf)
    longest = f'{never} never' if never else f'{max(taken):.1f}'
    return longest if middle == math.inf else f'{middle:.1f}, {longest}'


# --- outliers that agree

def _misled(agreeing: Sequence[Record]) -> Iterator[Row]:
    for number, (begin, share) in enumerate(AGREEING.bursts):
        name = f'{share:.0%} agree'
        end = [*AGREEING.bursts[1:], (AGREEING.seconds, 0.0)][number][0]
        misled = sum(_furthest(one.estimated, one.truth, begin, end) > MISLED_M
                     for one in agreeing)
        yield Row(f'{name}: drives whose estimate follows', f'{misled}', '-', True)
        yield _distances(f'{name}: published pose off', agreeing, begin, end)
        after = [_recovery(one, one.bursts[number].end) for one in agreeing]
        yield _times(f'{name}: estimate right', 'estimated', after, lambda one: one.believed)
        yield _times(f'{name}: published pose right', 'published', after)


def _distances(name: str, records: Sequence[Record], begin: float, end: float) -> Row:
    metres = [_furthest(one.read, one.truth, begin, end) for one in records]
    return Row(f'{name}, m', f'{np.median(metres):.1f}, {max(metres):.1f}', '-', True)


def _furthest(rows: Array, truth: Motion, begin: float, end: float) -> float:
    part = slice(round(begin / _PERIOD_S), round(end / _PERIOD_S))
    return float(np.linalg.norm(rows[part, :3] - truth.positions[part], axis=1).max())


def _at_most(name: str, value: float, most: float, form: str) -> Row:
    return Row(name, format(value, form), f'<= {most:{form}}', value <= most + _ROUNDING)
