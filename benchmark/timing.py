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

"""
Taking times, and comparing them fairly on a machine that does other things too.

Standard library only, for a contestant in another Python imports this too.
"""

from collections.abc import Callable, Iterable, Mapping
import gc
import statistics
import time
from typing import NamedTuple

# For single short calls: their median does not mind that others run in between.
clock = time.perf_counter
# For long stretches of one thread: what others do in between does not count.
cpu_clock = time.thread_time

Rounds = dict[str, list[float]]


class Spread(NamedTuple):
    """The least, the middle and the greatest of several rounds."""

    least: float
    median: float
    greatest: float


def spread(values: Iterable[float]) -> Spread:
    """Return the spread of some values."""
    values = list(values)
    return Spread(min(values), statistics.median(values), max(values))


def interleave(contestants: Mapping[str, Callable[[], float]], rounds: int) -> Rounds:
    """
    Let everybody run once a round, each round in another order.

    So whatever else the machine does falls on all of them.
    """
    names = list(contestants)
    results: Rounds = {name: [] for name in names}
    for number in range(rounds):
        first = number % len(names)
        for name in names[first:] + names[:first]:
            gc.collect()
            results[name].append(contestants[name]())
    return results


def ratios(ours: Iterable[float], theirs: Iterable[float]) -> list[float]:
    """Return the ratio in each round: neighbours in time are compared."""
    return [a / b for a, b in zip(ours, theirs, strict=True)]


def cost_of_clock() -> float:
    """Return what a pair of clock readings adds to what is between them, seconds."""
    pairs = [-(clock() - clock()) for _ in range(2001)]
    return statistics.median(pairs)


def time_one(call: Callable[[], object]) -> float:
    """Return the seconds that a long call takes."""
    begin = clock()
    call()
    return clock() - begin


def time_each(call: Callable[[], object], count: int) -> float:
    """Return the seconds that a short call takes, of so many."""
    begin = cpu_clock()
    for _ in range(count):
        call()
    return (cpu_clock() - begin) / count
