# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure times, and compare them fairly on a busy machine.

Uses the standard library only, because a contestant in another Python also imports this module.
"""

from collections.abc import Callable, Iterable, Mapping
import gc
import statistics
import time
from typing import NamedTuple, TypeVar

# For single short calls, whose median is robust against other processes.
clock = time.perf_counter
# For long spans of one thread, without the time of other processes.
cpu_clock = time.thread_time

Rounds = dict[str, list[float]]

_Name = TypeVar('_Name')


class Spread(NamedTuple):
    """The least, the median and the greatest of several rounds."""

    least: float
    median: float
    greatest: float


def spread(values: Iterable[float]) -> Spread:
    """Return the spread of some values."""
    values = list(values)
    return Spread(min(values), statistics.median(values), max(values))


def interleave(contestants: Mapping[_Name, Callable[[], float]], rounds: int
               ) -> dict[_Name, list[float]]:
    """
    Run every contestant once per round, each round in another order.

    Other load of the machine thus affects all contestants equally.
    """
    names = list(contestants)
    results: dict[_Name, list[float]] = {name: [] for name in names}
    for number in range(rounds):
        first = number % len(names)
        for name in names[first:] + names[:first]:
            gc.collect()
            results[name].append(contestants[name]())
    return results


def ratios(ours: Iterable[float], theirs: Iterable[float]) -> list[float]:
    """Return the ratio in each round, in which both ran at about the same time."""
    return [a / b for a, b in zip(ours, theirs, strict=True)]


def cost_of_clock() -> float:
    """Return the time that two clock readings add to a measurement, seconds."""
    pairs = [-(clock() - clock()) for _ in range(2001)]
    return statistics.median(pairs)


def time_one(call: Callable[[], object]) -> float:
    """Return the seconds that a long call takes."""
    begin = clock()
    call()
    return clock() - begin


def time_each(call: Callable[[], object], count: int) -> float:
    """Return the seconds that a short call takes, measured over a number of calls."""
    begin = cpu_clock()
    for _ in range(count):
        call()
    return (cpu_clock() - begin) / count
