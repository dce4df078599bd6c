# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An edge on a spline: an event camera's stamps, a single stamp, and the cost of fitting."""

from collections.abc import Callable, Iterator
from typing import Any
import warnings

import numpy as np
import numpy.typing as npt
from tf_tree_py import BufferCore, Spline, SplineFitter, UNLIMITED
from tf_tree_py.core import TransformWarning
from tf_tree_py.core.geometry import se3

from .many import many_of
from .. import motion
from ..effort import Effort
from ..exercise import Task
from ..motion import PERIOD, START
from ..peers.finding import Contestants
from ..rows import OURS, Row, RUST, scaled
from ..timing import interleave, time_each, time_one

SPLINE = f'{OURS}, a spline'

_HISTORY_S = 10.0
_SAMPLES = round(_HISTORY_S * 1e9) // PERIOD
_EVENTS = 100_000
_KNOTS_HZ = 50.0
_FIT_PERIOD = 1_000_000
_FIT_MS = 15.0


def continuous(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure a path of depth 3 with one edge on a spline."""
    exercises = contestants.exercises(Task('chain3', _HISTORY_S, False, 1), (OURS, RUST))
    asks = {name: many_of(exercise) for name, exercise in exercises.items()}
    robot = motion.robot('chain3')
    curved = _with_a_spline(robot)
    asks[SPLINE] = lambda stamps: curved.lookup_many(robot.target, robot.source, stamps)
    draws = np.random.default_rng(1)
    for seconds in 0.1, 5.0:
        yield _events(asks, effort, draws, seconds)
    yield _errors(asks, robot)
    yield _one_stamp(exercises[OURS].peer.buffer, curved, robot, effort)
    yield from _fitting(effort)


def _with_a_spline(robot: motion.Robot) -> BufferCore:
    """Return a buffer with the robot's samples, the middle edge replaced by their spline."""
    buffer = BufferCore(UNLIMITED)
    for edge in robot.edges:
        stamps, poses = _samples(edge, _SAMPLES, PERIOD)
        buffer.insert_track(edge.parent, edge.child, stamps, poses)
        if edge.number == 1:
            with warnings.catch_warnings():
                warnings.simplefilter('ignore', TransformWarning)  # now another kind of edge
                buffer.insert_curve(edge.parent, edge.child,
                                    Spline.fit(stamps, poses, _KNOTS_HZ))
    return buffer


def _samples(edge: motion.Edge, count: int, period: int) -> tuple[Any, npt.NDArray[np.float64]]:
    stamps = START + np.arange(count) * period
    return stamps, np.array([motion.pose_at(edge, stamp) for stamp in stamps.tolist()])


def _events(asks: dict[str, Callable[[Any], Any]], effort: Effort,
            draws: np.random.Generator, seconds: float) -> Row:
    """Return the time for a batch of events, different ones each time."""
    def turn(ask: Callable[[Any], Any]) -> float:
        begin = START + draws.integers(10**9, round(1e9 * (_HISTORY_S - 1.0 - seconds)))
        stamps = np.sort(begin + draws.integers(0, round(seconds * 1e9), _EVENTS))
        return time_one(lambda: ask(stamps))

    turns = {name: (lambda ask=ask: turn(ask)) for name, ask in asks.items()}
    row = Row('continuous', f'{_EVENTS:,} events in {seconds:g} s', 'ms',
              scaled(interleave(turns, effort.rounds), 1e3))
    row.compare(SPLINE, RUST, unit='x linear interpolation in Rust')
    row.compare(SPLINE, OURS, unit='x lerp and slerp')
    return row


def _errors(asks: dict[str, Callable[[Any], Any]], robot: motion.Robot) -> Row:
    """Return the deviation of the results from the motion that was sampled."""
    stamps = np.sort(np.random.default_rng(2).integers(
        START + 10**9, START + 9 * 10**9, 2_000))
    truth = np.tile(se3.IDENTITY, (len(stamps), 1))
    for edge in robot.edges:
        truth = se3.compose_many(truth, np.array(
            [motion.pose_at(edge, stamp) for stamp in stamps.tolist()]))
    values = {}
    for name, ask in asks.items():
        poses = ask(stamps)
        if name == RUST:
            poses = poses[:, [4, 5, 6, 1, 2, 3, 0]]
        values[name] = [float(se3.distance_many(truth, poses)[0].max()) * 1e6]
    row = Row('continuous', 'largest error, all edges sampled at 100 Hz', 'um', values)
    row.compare(SPLINE, OURS, unit='x lerp and slerp')
    return row


def _one_stamp(straight: Any, curved: BufferCore, robot: motion.Robot, effort: Effort) -> Row:
    """Return the time of a lookup over a path with a spline, and over one without."""
    stamp = START + 5 * 10**9 + 1234
    target, source = robot.target, robot.source

    def of(buffer: Any) -> Callable[[], float]:
        return lambda: time_each(lambda: buffer.lookup(target, source, stamp), effort.lookups)

    row = Row('continuous', 'one lookup, depth 3', 'us', scaled(interleave(
        {OURS: of(straight), SPLINE: of(curved)}, effort.rounds), 1e6))
    row.compare(SPLINE, OURS, unit='x lerp and slerp')
    return row


def _fitting(effort: Effort) -> Iterator[Row]:
    """Measure the fit of a second at 1 kHz, and the incremental fit of arriving poses."""
    stamps, poses = _samples(motion.chain(1).edges[0], 1_001, _FIT_PERIOD)
    for on_se3 in False, True:
        group = 'SE(3)' if on_se3 else 'R3 x SO(3)'

        def fit(on_se3: bool = on_se3) -> float:
            return time_each(lambda: Spline.fit(stamps, poses, _KNOTS_HZ, on_se3=on_se3), 1)

        row = Row('continuous', f'fit 1 s of 1 kHz, {_KNOTS_HZ:g} knots/s, {group}', 'ms',
                  scaled(interleave({OURS: fit}, effort.rounds), 1e3))
        row.judge(OURS, None if on_se3 else _FIT_MS)
        yield row
    turns = {f'{OURS}, {batch} at a time': (lambda batch=batch: _adding(stamps, poses, batch))
             for batch in (1, 10)}
    yield Row('continuous', 'add poses at 1 kHz as they come', 'ms',
              scaled(interleave(turns, effort.rounds), 1e3))


def _adding(stamps: Any, poses: Any, batch: int) -> float:
    """Return the seconds of one ``add``, once there are knots to freeze."""
    fitter = SplineFitter(_KNOTS_HZ)
    fitter.add(stamps[:500], poses[:500])
    parts = iter([slice(begin, begin + batch) for begin in range(500, 500 + 20 * batch, batch)])
    return time_each(lambda: fitter.add(stamps[part := next(parts)], poses[part]), 20)
