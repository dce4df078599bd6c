# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Features beyond tf2, which must cost nothing when unused."""

from collections.abc import Callable, Iterator
from functools import partial
import itertools
import time
from typing import Any

import numpy as np
from tf_tree_py import BufferCore, UNLIMITED
from tf_tree_py.core import Pose, se3
from tf_tree_py.core.geometry.so3 import Array

from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import GTSAM, Row, scaled
from ..timing import interleave, time_each

_PLAIN, _BESIDE, _AIDED = 'plain', 'the same, edges uncertain', 'the same, edges aided'
_IDLE = 'the same, edges corrected'
_UNCERTAIN, _LARGE, _AHEAD = 'lookup_uncertain', 'lookup_uncertain, 2 deg', 'predict, 50 ms ahead'
_AHEAD_LIVE = 'predict, each after new samples'
_BUDGET, _MANY = 'lookup_budget', 'lookup_uncertain_many, each of 1,000'
_LATEST, _LIMITED = 'the latest', 'the latest, with max_age'
_DEFAULT, _NEWEST = 'the latest, with the max_age of the buffer', 'lookup_newest'
_ABOUT_THE_SAME = 1.03
_CORRECTED_AT_MOST = 1.05

_FRAMES = ('map', 'odom', 'base', 'torso', 'head', 'camera')
_STEP, _COUNT = 10_000_000, 1000
_SMALL, _STAMPS = 0.1, 1000
# As multiples of a plain lookup.
_GOALS = {_AIDED: 2.0, _UNCERTAIN: 6.0, _LARGE: 40.0, _BUDGET: 8.0, _MANY: 1.0, _AHEAD: 15.0}
_ASKED = _STEP * _COUNT // 2
_AHEAD_BY = 50_000_000


def _covariance(degrees: float) -> Array:
    return np.diag([1e-6] * 3 + [np.radians(degrees) ** 2] * 3)


def _filled(degrees: float | None = None, **options: Any) -> BufferCore:
    """Return five moving edges, each with a covariance if a deviation is given."""
    covariance = None if degrees is None else _covariance(degrees)
    buffer = BufferCore(**options)
    for stamp in range(_STEP, _STEP * _COUNT + 1, _STEP):
        _insert(buffer, stamp, covariance)
    return buffer


def _insert(buffer: BufferCore, stamp: int, covariance: Array | None = None) -> None:
    """Insert a sample of each edge."""
    pose = Pose.from_xyz_rpy(x=1.0, yaw=1e-9 * stamp)
    for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False):
        buffer.insert(parent, child, stamp, pose, covariance=covariance)


def _aided() -> BufferCore:
    buffer = _filled()
    stamps = np.arange(0, _STEP * _COUNT + 1, _STEP // 10)
    for child in _FRAMES[1:]:
        buffer.aid(child, stamps, np.full((len(stamps), 3), (0.0, 0.0, 1.0)))
    return buffer


def _corrected() -> BufferCore:
    """Return edges whose corrections ended before the stamps that are looked up."""
    buffer = BufferCore()
    for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False):
        for stamp in range(_STEP, _STEP * _COUNT + 1, _STEP):
            buffer.insert(parent, child, stamp, Pose.from_xyz_rpy(x=1.0, yaw=1e-9 * stamp))
            if stamp == _STEP:
                buffer.correct(child, Pose(x=0.1), over=_STEP)
    return buffer


def _asking(ask: Callable[..., object], count: int, *more: int,
            stamp: int = _ASKED) -> Callable[[], float]:
    """Return a turn of lookups, each at another stamp."""
    def turn() -> float:
        stamps = iter(range(stamp, stamp + count))
        return time_each(lambda: ask('map', 'camera', next(stamps), *more), count)

    return turn


def _latest(ask: Callable[..., object], count: int, **limit: int) -> Callable[[], float]:
    """Return a turn of lookups of the latest."""
    return lambda: time_each(lambda: ask('map', 'camera', **limit), count)


def _predicting(buffer: BufferCore, count: int) -> Callable[[], float]:
    """Return a turn of predictions, each after another sample of each edge, as in a node."""
    stamps = itertools.count(_STEP * (_COUNT + 1), _STEP)

    def turn() -> float:
        spent = 0.0
        for stamp in itertools.islice(stamps, count):
            _insert(buffer, stamp)
            spent += time_each(
                partial(buffer.predict, 'map', 'camera', stamp + _AHEAD_BY, 10**9), 1)
        return spent / count

    return turn


def _asking_many(buffer: BufferCore) -> Callable[[], float]:
    """Return a turn of one lookup of many stamps; its time is that per stamp."""
    stamps = np.random.default_rng(1).integers(_STEP, _STEP * _COUNT, _STAMPS)
    return lambda: time_each(lambda: buffer.lookup_uncertain_many(
        'map', 'camera', stamps), 3) / _STAMPS


def _by_gtsam(contestants: Contestants, buffer: BufferCore,
              count: int) -> Callable[[], float] | None:
    """Return a turn of GTSAM on the poses of the same edges; None if it is not installed."""
    if contestants.gtsam is None:
        return None
    graph = contestants.gtsam(_covariance(_SMALL))
    poses = [buffer.lookup(parent, child, _ASKED)
             for parent, child in zip(_FRAMES, _FRAMES[1:], strict=False)]
    _check(graph.covariance(poses)[1], buffer.lookup_uncertain('map', 'camera', _ASKED))
    return lambda: time_each(lambda: graph.covariance(poses), count)


def _check(theirs: Array, ours: tuple[Pose, Array]) -> None:
    """Compare GTSAM's covariance, rotation first and in the camera's axes, with ours."""
    turn = np.kron(np.eye(2), np.array(se3.as_matrix(ours[0]))[:3, :3])
    order = [3, 4, 5, 0, 1, 2]
    turned = turn @ theirs[np.ix_(order, order)] @ turn.T
    assert np.allclose(turned, ours[1], atol=1e-3 * np.abs(ours[1]).max()), (turned, ours)


def uncertain(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups over five moving edges: uncertain, aided, predicted, and of the latest."""
    plain, small, large, aided = _filled(), _filled(_SMALL), _filled(2.0), _aided()
    corrected, limited = _corrected(), _filled(now=time.time_ns, max_age=UNLIMITED - 1)
    # With a tenth of the lookups, turns take about as long as those of plain lookups. In shorter
    # ones the first lookups, with cold caches, would count for more.
    few = max(effort.lookups // 10, 1)
    turns = {
        _PLAIN: _asking(plain.lookup, effort.lookups),
        _BESIDE: _asking(small.lookup, effort.lookups),
        _IDLE: _asking(corrected.lookup, effort.lookups),
        _AIDED: _asking(aided.lookup, effort.lookups),
        _UNCERTAIN: _asking(small.lookup_uncertain, few),
        _LARGE: _asking(large.lookup_uncertain, few),
        _BUDGET: _asking(small.lookup_budget, few),
        _MANY: _asking_many(small),
        _AHEAD: _asking(plain.predict, few, 10**9, stamp=_STEP * _COUNT + _AHEAD_BY),
        _AHEAD_LIVE: _predicting(_filled(), few),
        _LATEST: _latest(plain.lookup, effort.lookups),
        _LIMITED: _latest(limited.lookup, effort.lookups, max_age=UNLIMITED - 1),
        _DEFAULT: _latest(limited.lookup, effort.lookups),
        _NEWEST: _latest(plain.lookup_newest, effort.lookups),
    }
    theirs = _by_gtsam(contestants, small, few)
    if theirs is not None:
        turns[GTSAM] = theirs
    row = Row('uncertain', '5 moving edges', 'us', scaled(interleave(turns, effort.rounds), 1e6))
    row.compare(_BESIDE, _PLAIN, _ABOUT_THE_SAME, name='a plain lookup of uncertain edges',
                unit='x one of certain edges')
    row.compare(_IDLE, _PLAIN, _CORRECTED_AT_MOST, name='a plain lookup of corrected edges',
                unit='x one of edges that never were')
    for name, target in _GOALS.items():
        row.compare(name, _PLAIN, target, name=name, unit='x a plain lookup')
    row.compare(_AHEAD_LIVE, _PLAIN, name=_AHEAD_LIVE, unit='x a plain lookup')
    for name in _LIMITED, _DEFAULT, _NEWEST:
        row.compare(name, _LATEST, name=name, unit='x the latest')
    row.compare(_UNCERTAIN, GTSAM, 1.0, name=_UNCERTAIN, unit='x GTSAM')
    yield row
