# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Many stamps at once, at depth 3: 100,000 and 1,000 stamps, and a lidar's scan."""

from collections.abc import Callable, Iterator
import tracemalloc
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry import se3

from .. import motion
from ..effort import Effort
from ..exercise import Exercise, Task
from ..motion import PERIOD, START
from ..peers.finding import agree, Contestants
from ..rows import DEBIAN, JAZZY, OURS, PYTRANSFORM, Row, RUST, scaled
from ..timing import interleave, time_one

Stamps = npt.NDArray[np.int64]

_COUNT = 100_000
_HISTORY_S = 10.0
_SAMPLES = round(_HISTORY_S * 1e9) // PERIOD
# A loop over all of them would take half a second per round.
_IN_A_LOOP = 2_000
# A lidar's scan: a column of points every 50 us for a tenth of a second.
_SCAN, _SCAN_TIME = 2_000, 100_000_000

_ATTEMPTS = 3

_OF_RUST = 0.7
_OF_A_LOOP = 0.1
_PEAK_MEMORY = 3.0


class _Draws:
    """
    The stamps of each round, the same for all contestants, and new ones in every round.

    The window slides by one sample per round, because every contestant inserts one on each edge
    before its lookup. Results of the last round cannot be reused.
    """

    def __init__(self, count: int, shuffled: bool, within: int | None = None) -> None:
        """
        Store the number of stamps and their distribution.

        :param within: nanoseconds over which they are spaced evenly, like a lidar's points; None:
            anywhere in the history.
        """
        self._count = count
        self._shuffled = shuffled
        self._within = within

    def of(self, round_number: int, attempt: int = 0) -> Stamps:
        """Return the stamps of an attempt in a round, counted from 1."""
        # The span that every edge covers, including after the next insertion.
        first = START + (round_number + 2) * PERIOD
        last = START + (_SAMPLES + round_number - 2) * PERIOD
        generator = np.random.default_rng([round_number, attempt])
        if self._within is not None:
            begin = generator.integers(first, last - self._within)
            return begin + np.arange(self._count) * self._within // self._count
        stamps = generator.integers(first, last, self._count)
        return stamps if self._shuffled else np.sort(stamps)


def many(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure all contestants that support it."""
    yield _row(contestants, effort, 'chain3', _COUNT, shuffled=False, judged=True)
    yield _row(contestants, effort, 'chain3', _COUNT, shuffled=True, judged=True)
    yield _row(contestants, effort, 'staggered3', _COUNT, shuffled=False)
    yield _row(contestants, effort, 'staggered3', _COUNT, shuffled=True)
    yield _row(contestants, effort, 'chain3', _COUNT // 100, shuffled=False)
    yield _row(contestants, effort, 'chain3', _SCAN, shuffled=False, within=_SCAN_TIME)
    yield _row(contestants, effort, 'staggered3', _SCAN, shuffled=False, within=_SCAN_TIME)
    yield _memory(contestants)


def _row(contestants: Contestants, effort: Effort, robot: str, count: int, *,
         shuffled: bool, within: int | None = None, judged: bool = False) -> Row:
    exercises = contestants.exercises(
        Task(robot, _HISTORY_S, False, 1), (OURS, DEBIAN, JAZZY, RUST))
    draws = _Draws(count, shuffled, within)
    turns = {name: _Turn(exercise, draws, _way_of(name, exercise))
             for name, exercise in exercises.items()}
    _check(turns, draws)
    callables: dict[str, Callable[[], float]] = dict(turns)
    if contestants.pytransform and robot == 'chain3':
        callables[PYTRANSFORM] = _pytransform(contestants, turns[OURS], draws, effort.rounds)
    order = 'one scan' if within else 'shuffled' if shuffled else 'sorted'
    remark = ', staggered samples' if robot == 'staggered3' else ''
    row = Row('many', f'{count:,} stamps, {order}{remark}', 'ms',
              scaled(interleave(callables, effort.rounds), 1e3))
    row.compare(OURS, RUST, _OF_RUST if judged else None)
    row.compare(OURS, DEBIAN, _OF_A_LOOP if judged else None, unit='x a loop of C++ tf2')
    row.compare(OURS, JAZZY, unit='x a loop of C++ tf2 (Jazzy)')
    row.compare(OURS, PYTRANSFORM)
    return row


class _Turn:
    """
    One contestant's turn: an insertion on each edge, then all stamps, which is timed.

    The best of three attempts counts, each with different stamps. Contestants with several
    threads need the wall clock, which also measures other load of the machine.
    """

    def __init__(self, exercise: Any, draws: _Draws, way: Callable[[Stamps], float]) -> None:
        self.exercise = exercise
        self._draws = draws
        self._way = way
        self._rounds = 0

    def __call__(self) -> float:
        self._rounds += 1
        self.exercise.insertions(batches=1)
        return min(self._way(self._draws.of(self._rounds, attempt))
                   for attempt in range(_ATTEMPTS))


def _way_of(name: str, exercise: Any) -> Callable[[Stamps], float]:
    """Return a function that looks up many stamps and returns the seconds it took."""
    if name in (OURS, RUST):
        ask = many_of(exercise)
        return lambda stamps: time_one(lambda: ask(stamps))
    # They look up at most some of the stamps; the time is scaled to all.
    return lambda stamps: len(stamps) * float(exercise.loop(stamps=_some(stamps)))


def many_of(exercise: Exercise) -> Callable[[Stamps], Any]:
    """Return our or Rust's lookup of many stamps."""
    peer: Any = exercise.peer
    robot = exercise.robot
    if hasattr(peer, 'lookup_many'):
        return peer.lookup_many
    return lambda stamps: peer.buffer.lookup_many(robot.target, robot.source, stamps)


def _some(stamps: Stamps) -> list[int]:
    step = max(1, len(stamps) // _IN_A_LOOP)
    return [int(stamp) for stamp in stamps[::step]]


def _check(turns: dict[str, _Turn], draws: _Draws) -> None:
    """Compare all results before there are insertions."""
    stamps = draws.of(0)
    picked = np.linspace(0, len(stamps) - 1, 20).astype(int)
    answers = {}
    for name, turn in turns.items():
        exercise = turn.exercise
        if name in (OURS, RUST):
            poses = many_of(exercise)(stamps)[picked]
            if name == RUST:
                poses = poses[:, [4, 5, 6, 1, 2, 3, 0]]
            answers[name] = poses.tolist()
        else:
            answers[name] = [exercise.answer(stamp=int(stamp)) for stamp in stamps[picked]]
    agree(answers)


def _pytransform(contestants: Contestants, ours: _Turn, draws: _Draws,
                 rounds: int) -> Callable[[], float]:
    """Return the turn of pytransform3d, which receives all samples beforehand."""
    samples = START + np.arange(_SAMPLES + rounds) * PERIOD
    manager = contestants.pytransform(motion.chain(3), samples)
    robot = ours.exercise.robot
    # Between samples it interpolates screw motions, so results are compared at samples.
    known = samples[10:_SAMPLES - 10:50]
    agree({OURS: ours.exercise.peer.buffer.lookup_many(robot.target, robot.source, known).tolist(),
           PYTRANSFORM: se3.from_matrix_many(manager.lookup_many(known)).tolist()})
    rounds_of_stamps = (draws.of(number) for number in range(1, rounds + 1))

    def turn() -> float:
        stamps = next(rounds_of_stamps)
        return time_one(lambda: manager.lookup_many(stamps))

    return turn


def _memory(contestants: Contestants) -> Row:
    """Return the peak memory of a lookup."""
    exercise = contestants.exercises(Task('chain3', _HISTORY_S, False, 1), (OURS,))[OURS]
    ask = many_of(exercise)
    values: dict[str, list[float]] = {OURS: []}
    for round_number in range(1, 6):
        exercise.insertions(batches=1)
        stamps = _Draws(_COUNT, shuffled=bool(round_number % 2)).of(round_number)
        tracemalloc.start()
        answer = ask(stamps)
        values[OURS].append(tracemalloc.get_traced_memory()[1] / answer.nbytes)
        tracemalloc.stop()
    row = Row('many', f'peak memory of {_COUNT:,} stamps', "answer's size", values)
    row.judge(OURS, _PEAK_MEMORY)
    return row
