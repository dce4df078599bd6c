# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Calibration: its duration and accuracy, compared with KinHEC's reference solvers."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
import time
from typing import Any

import numpy as np
from tf_tree_py import BufferCore, screws
from tf_tree_py.calibration import calibrate, Observations
from tf_tree_py.core import Pose, se3, UNLIMITED

from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import KINHEC, OURS, Row

_COUNT, _PERIOD = 2000, 10_000_000
_FRAMES = ('map', 'odom', 'base', 'torso', 'head', 'flange')
_AT_MOST_S = 2.0


def _robot() -> tuple[BufferCore, tuple[str, str], Observations]:
    """Return five moving edges, a wrong mounting, and 2,000 observations."""
    rng = np.random.default_rng(5)
    seconds = np.arange(0.0, 62.0, 0.01)
    stamps = 10**9 + np.round(seconds * 1e9).astype(np.int64)
    buffer = BufferCore(cache_time=UNLIMITED)
    for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False):
        waves = 0.2 * np.sin(np.outer(seconds, rng.uniform(0.3, 0.9, 6)) + rng.uniform(0, 6, 6))
        buffer.insert_track(parent, child, stamps, screws.exp_many(waves))
    buffer.insert('flange', 'camera', 0, Pose(x=0.1), static=True)
    taken = np.sort(rng.choice(stamps[100:-100], _COUNT, replace=False))
    camera = np.asarray(
        buffer.lookup_many('map', 'flange', taken) @ Pose.from_xyz_rpy(x=0.12, yaw=0.02))
    seen = se3.compose_many(se3.inverse_many(camera), np.array([Pose(x=3.0)]))
    seen = se3.compose_many(seen, screws.exp_many(0.002 * rng.normal(size=(_COUNT, 6))))
    return buffer, ('flange', 'camera'), Observations(
        'camera', taken + 40_000_000, seen, 'map')


def calibration(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the time for 2,000 observations, and the errors on KinHEC's tracks."""
    asked = _robot()
    rounds, busy = list[float](), list[float]()
    for _round in range(max(effort.rounds // 2, 1)):
        begin, busy_before = time.perf_counter(), time.process_time()
        calibrate(*asked, time=True)
        rounds.append(time.perf_counter() - begin)
        busy.append(time.process_time() - busy_before)
    row = Row('calibration', '2,000 observations over 5 moving edges', 's', {OURS: rounds})
    row.judge(OURS, _AT_MOST_S)
    yield row
    row = Row('calibration', 'CPU for 2,000 observations over 5 moving edges', 's', {OURS: busy})
    row.judge(OURS, _AT_MOST_S)
    yield row
    if contestants.kinhec:
        yield from _accuracy(effort.sequences)


def _accuracy(most: int | None) -> Iterator[Row]:
    from ..peers import kinhec_tracks as kinhec
    for track in kinhec.TRACKS:
        yield from _rows(track, kinhec.sequences(track, most),
                         partial(kinhec.ours, time=track == 'temporal'), kinhec.reference,
                         against=True)
    yield from _rows('50 ms late, jitter', kinhec.late_and_jittering(most or 40),
                     lambda each: kinhec.ours(each, time=True), kinhec.reference_with_time,
                     {'deg': 0.2, 'mm': 8.0, 'ms': 1.5})
    yield from _rows('20 % outliers', kinhec.with_outliers(most or 40), kinhec.ours,
                     kinhec.reference, {'deg': 0.5, 'mm': 5.0})


def _rows(name: str, sequences: Iterable[Any], ours: Callable[[Any], Any],
          theirs: Callable[[Any], Any], targets: dict[str, float] | None = None,
          against: bool = False) -> Iterator[Row]:
    """Yield rows of the errors of a track: of rotation, translation and time."""
    from ..peers.kinhec_tracks import over, STATISTICS
    found = [list(each) for each in zip(*[(ours(each), theirs(each)) for each in sequences],
                                        strict=True)]
    for statistic in STATISTICS if against else ('mean',):
        our_errors, their_errors = (over(each, statistic) for each in found)
        for unit, our, their in zip(('deg', 'mm', 'ms'), our_errors, their_errors, strict=True):
            if not (our or their):
                continue
            row = Row('calibration', f'KinHEC, {name}: {statistic} of {len(found[0])}', unit,
                      {OURS: [our]})
            if their:  # the reference has no error in time where it gets the true offset
                row.values[KINHEC] = [their]
            if against and their:
                row.compare(OURS, KINHEC, 1.0, name=f'{name}, {statistic}, {unit}')
            elif targets and unit in targets:
                row.judge(OURS, targets[unit], name=f'{name}, {unit}', unit=unit)
            yield row
