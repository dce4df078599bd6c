# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure the cost of reading an archive: python benchmark/archive_bench.py.

The argument is the number of bags. Each bag is one minute of ten edges at 10 Hz. The doctor
examines all of them with one worker, with two workers, and in a plain loop in one process,
which is the peer. A last run kills a worker in the middle. Then a trajectory of 100,000 stamps
over five edges is computed, and compared with one lookup per stamp.
On a shared machine, the CPU times are more meaningful than the rates.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
import os
from pathlib import Path
import shutil
import signal
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

import numpy as np
from tf_tree_py import BufferCore, from_seconds, Pose, UNLIMITED
from tf_tree_py.beyond.motion.trajectory import stamps_at_rate, trajectory
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.tools.archive.jobs import BagPath, bags_in, done, reported
from tf_tree_py.tools.archive.running import client_of, results
from tf_tree_py.tools.export.formats import FORMATS

JOB = partial(reported, Thresholds())


def moving(edges: int, rate_hz: int, seconds: int) -> BufferCore:
    """Return a chain of rotating edges with a camera at its end."""
    buffer = BufferCore(UNLIMITED)
    for number in range(seconds * rate_hz):
        t = number / rate_hz
        names = ['map', *(f'frame{edge}' for edge in range(edges))]
        for parent, child in zip(names, names[1:], strict=False):
            buffer.insert(parent, child, from_seconds(1_700_000_000) + from_seconds(t),
                          Pose.from_xyz_rpy(x=np.sin(t), yaw=0.3 * t))
    buffer.insert(names[-1], 'camera', 0, Pose(z=0.8), static=True)
    return buffer


@contextmanager
def archive(count: int) -> Iterator[list[BagPath]]:
    """Write similar bags; yield their paths."""
    with TemporaryDirectory() as folder:
        first = Path(folder, 'run_0.mcap')
        moving(edges=10, rate_hz=10, seconds=60).record(first)
        for number in range(1, count):
            shutil.copy(first, Path(folder, f'run_{number}.mcap'))
        yield bags_in([f'{folder}/*.mcap'])


def by_loop(bags: list[BagPath]) -> None:
    """Examine the bags one after the other."""
    for bag in bags:
        assert done(JOB, bag.path).row['outcome'] == 'fine'


def by_workers(client: Any, bags: list[BagPath], *, kill: bool = False) -> None:
    """Examine the bags on a cluster; optionally kill a worker in the middle."""
    seen = set[BagPath]()
    for bag, result in results(client, JOB, bags):
        assert result.row['outcome'] == 'fine' and bag not in seen, result.row
        seen.add(bag)
        if kill and len(seen) == len(bags) // 2:
            os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
    assert len(seen) == len(bags)


def cpu_of(call: Callable[[], object]) -> float:
    """Return the CPU seconds that a call takes in this process."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def workers_use(client: Any) -> tuple[float, float]:
    """Return the CPU seconds of all workers, and the memory of the largest, megabytes."""
    return (sum(client.run(time.process_time).values()), max(client.run(resident_mb).values()))


def resident_mb() -> float:
    """Return the resident memory of this process, megabytes."""
    import psutil
    return float(psutil.Process().memory_info().rss / 1e6)


def read_by_workers(workers: int, bags: list[BagPath], loop_s: float) -> None:
    """Print the cost of reading with workers, and with one of them killed."""
    with client_of(None, workers) as client:
        by_workers(client, bags[:5])
        before, _ = workers_use(client)
        begin = time.perf_counter()
        here = cpu_of(lambda: by_workers(client, bags))
        rate = len(bags) / (time.perf_counter() - begin)
        after, memory = workers_use(client)
        print(f'{workers} workers: {rate:.0f} bags/s; CPU of the workers '
              f'{(after - before) / loop_s:.2f} of the loop, of the collector '
              f'{here / loop_s:.2f}; {memory:.0f} MB a worker')
        by_workers(client, bags, kill=True)
        print(f'{workers} workers, one killed: every bag has one row')


def main() -> None:
    """Measure and print."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    with archive(count) as bags:
        by_loop(bags[:5])
        begin = time.perf_counter()
        loop = cpu_of(lambda: by_loop(bags))
        rate = count / (time.perf_counter() - begin)
        print(f'{count} bags, plain loop: {rate:.0f} bags/s, '
              f'{1e3 * loop / count:.0f} ms of CPU each')
        for workers in (1, 2):
            read_by_workers(workers, bags, loop)

    tree = moving(edges=4, rate_hz=100, seconds=60).snapshot()
    frames = 'map', 'camera'
    stamps = stamps_at_rate(tree, *frames, 100_000 / 60)
    one_by_one = cpu_of(lambda: [tree.lookup(*frames, stamp) for stamp in stamps.tolist()])
    many = cpu_of(lambda: trajectory(tree, *frames, stamps))
    taken = trajectory(tree, *frames, stamps)
    print(f'{len(stamps)} stamps over five edges: {many:.2f} s, {many / one_by_one:.3f} of one '
          'lookup a stamp; written as '
          + ', '.join(f'{form}: {cpu_of(partial(FORMATS[form], taken)):.2f} s'
                      for form in ('tum', 'csv', 'npz')))


if __name__ == '__main__':
    main()
