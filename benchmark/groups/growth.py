# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The cost of lookups and insertions as a buffer grows: samples, frames, threads.

Every group has the same measurement at a few sizes. All sizes and contestants take turns, so that
their ratios are those of one machine under one load.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
import threading
from typing import Any

from ..effort import Effort
from ..exercise import Task
from ..motion import PERIOD, START
from ..peers.finding import Contestants
from ..rows import Comparison, DEBIAN, JAZZY, OURS, PLAIN, RAW, Row, TF2_ROS
from ..timing import clock, interleave, ratios, spread

SAMPLES = (100, 1_000, 10_000, 100_000)
FRAMES = (10, 100, 1_000, 10_000)
THREADS = (1, 2, 4, 8)

_ALL = (OURS, DEBIAN, TF2_ROS, JAZZY)
_DEPTH = 5
_SAMPLES_A_SECOND = 1_000_000_000 // PERIOD
# A linear search through 100,000 samples of five edges takes milliseconds.
_MOST_LOOKUPS = 100
# Every frame of a wide tree has ten samples, so that 10,000 frames are inserted in seconds.
_SHORT_S = 0.1
# Frames that the lookups of a round return, and samples that its insertions add, at least.
_FRAMES_A_ROUND, _INSERTIONS_A_ROUND = 4_000, 2_000

# Threads need a while to run into each other, so a round has this many times the usual lookups.
_LOOKUPS_OF_A_THREAD = 10

Turn = Callable[[], float]


def samples(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups at old stamps and of the latest, over the samples of each edge."""
    count = min(effort.lookups, _MOST_LOOKUPS)
    turns: dict[tuple[str, int, str], Turn] = {}
    for size in SAMPLES[:effort.sizes]:
        exercises = contestants.exercises(
            Task(f'chain{_DEPTH}', size / _SAMPLES_A_SECOND, False, count, anywhere=True), _ALL)
        for quantity, latest in ('old stamp', False), ('latest', True):
            for name, exercise in exercises.items():
                turns[quantity, size, name] = partial(_turn, exercise, latest, count)
    yield from rows_by_size('growth_samples', 'samples', {'old stamp': 'us', 'latest': 'us'},
                            interleave(turns, effort.streams))


def _turn(exercise: Any, latest: bool, count: int) -> float:
    """Return the microseconds per lookup; both kinds of stamps share one buffer."""
    exercise.change(latest=latest, count=count)
    return 1e6 * float(exercise.take_turn())


def frames(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure lookups, insertions and whole trees over the frames beside a chain of five edges."""
    turns: dict[tuple[str, int, str], Turn] = {}
    for size in FRAMES[:effort.sizes]:
        task = Task(f'wide{size}', _SHORT_S, False, effort.lookups)
        for name, exercise in contestants.exercises(task, _ALL).items():
            turns['lookup', size, name] = partial(_scaled, exercise.take_turn, 1e6)
        # Of their own, because either measurement continues where its own last round ended.
        batches = max(1, _INSERTIONS_A_ROUND // size)
        for name, exercise in contestants.exercises(task, _ALL).items():
            turns['insertion', size, name] = partial(
                _scaled, partial(exercise.insertions, batches=batches), 1e6)
        trees = task._replace(count=max(3, _FRAMES_A_ROUND // size), whole_tree=True)
        for name, exercise in contestants.exercises(trees, (OURS, DEBIAN, JAZZY)).items():
            turns['whole tree', size, name] = partial(_scaled, exercise.take_turn, 1e6 / size)
    yield from rows_by_size('growth_frames', 'frames',
                            {'lookup': 'us', 'insertion': 'us', 'whole tree': 'us a frame'},
                            interleave(turns, effort.streams))


def _scaled(turn: Turn, factor: float) -> float:
    return factor * turn()


# --- threads

def threads(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure how many lookups per second several threads get out of one buffer in total."""
    history = 10 * _SHORT_S
    exercises = contestants.exercises(
        Task(f'chain{_DEPTH}', history, False, effort.lookups), (OURS, TF2_ROS, JAZZY))
    turns: dict[tuple[str, int, str], Turn] = {}
    for size in THREADS[:effort.sizes]:
        for name, exercise in exercises.items():
            look = looker(exercise, START + round(history * 1e9) // 2 + PERIOD // 3)
            turns['in total', size, name] = partial(
                lookups_a_second, look, size, _LOOKUPS_OF_A_THREAD * effort.lookups)
    yield from rows_by_size('growth_threads', 'threads', {'in total': 'lookups a second'},
                            interleave(turns, effort.streams))


def looker(exercise: Any, stamp: int) -> Callable[[], Any]:
    """Return a function that looks up the chain of an exercise at a stamp."""
    robot, peer = exercise.robot, exercise.peer
    return partial(peer.lookup, robot.target, robot.source, peer.time(stamp))


def lookups_a_second(look: Callable[[], Any], number: int, lookups: int) -> float:
    """
    Return the lookups per second of several threads in total.

    :param number: of threads, which all begin at the same time.
    :param lookups: of all threads together.
    :raises RuntimeError: a thread ended early.
    """
    each = lookups // number
    ready = threading.Barrier(number)
    spans: list[tuple[float, float]] = []

    def run() -> None:
        ready.wait()
        begin = clock()
        for _ in range(each):
            look()
        spans.append((begin, clock()))

    workers = [threading.Thread(target=run) for _ in range(number)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    if len(spans) != number:
        raise RuntimeError('a lookup failed in a thread')
    begins, ends = zip(*spans, strict=True)
    return number * each / (max(ends) - min(begins))


# --- rows

def rows_by_size(group: str, noun: str, units: Mapping[str, str],
                 rounds: Mapping[tuple[str, int, str], Sequence[float]]) -> Iterator[Row]:
    """
    Yield a row per quantity and size, compared with others and the smallest size.

    :param units: of each quantity.
    :param rounds: the values by quantity, size and contestant.
    """
    for quantity, unit in units.items():
        smallest: Row | None = None
        for size in dict.fromkeys(size for known, size, _ in rounds if known == quantity):
            row = Row(group, row_name(quantity, size, noun), unit, {
                name: list(values) for (known, number, name), values in rounds.items()
                if (known, number) == (quantity, size)})
            smallest = smallest or row
            if unit != '%':
                _compare(row, smallest)
            yield row


def row_name(quantity: str, size: int, noun: str) -> str:
    """Return the name of a row, from which ``growth_plot`` reads the quantity and the size."""
    return f'{quantity}, {size:,} {noun.removesuffix("s") if size == 1 else noun}'


def _compare(row: Row, smallest: Row) -> None:
    """Add the ratios to others, and to the smallest size, measured in the same rounds."""
    for other in _ALL[1:] + (PLAIN, RAW):
        row.compare(OURS, other)
    if row is smallest:
        return
    unit = f'x {smallest.name.rpartition(", ")[2]}'
    row.comparisons.append(Comparison(
        row.name, spread(ratios(row.values[OURS], smallest.values[OURS])), unit))
