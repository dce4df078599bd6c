"""
What reading an archive costs: python benchmark/archive_bench.py.

Takes the number of bags as an argument. Each is a minute of ten edges at 10 Hz; the
doctor is asked about all of them by one and by two workers, and by a plain loop in one
process, which is the peer. Of two workers one is killed in the middle, once more. Then a
trajectory of 100,000 stamps over five edges is made, beside one lookup a stamp.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
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
from tf_tree_py.core.trajectory import stamps_at_rate, trajectory
from tf_tree_py.core.vitals.limits import Limits
from tf_tree_py.tools.archive.bags import BagPath, bags_in
from tf_tree_py.tools.archive.cluster import client_of
from tf_tree_py.tools.archive.jobs import done, ReportJob
from tf_tree_py.tools.archive.running import results
from tf_tree_py.tools.export.formats import FORMATS

JOB = ReportJob(Limits())


def moving(edges: int, rate_hz: int, seconds: int) -> BufferCore:
    """Return a chain of edges that turn, and a camera at its end."""
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
    """Make bags that are alike."""
    with TemporaryDirectory() as folder:
        first = Path(folder, 'run_0.mcap')
        moving(edges=10, rate_hz=10, seconds=60).record(first)
        for number in range(1, count):
            shutil.copy(first, Path(folder, f'run_{number}.mcap'))
        yield bags_in([f'{folder}/*.mcap'])


def by_loop(bags: list[BagPath]) -> None:
    """Read them one after the other."""
    for bag in bags:
        assert done(JOB, bag.path).row['outcome'] == 'fine'


def by_workers(client: Any, bags: list[BagPath], *, kill: bool = False) -> None:
    """Read them on a cluster; kill a worker in the middle."""
    seen = set[BagPath]()
    for bag, result in results(client, JOB, bags):
        assert result.row['outcome'] == 'fine' and bag not in seen, result.row
        seen.add(bag)
        if kill and len(seen) == len(bags) // 2:
            os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
    assert len(seen) == len(bags)


def timed(call: Callable[[], object]) -> float:
    """Return the seconds that a call takes."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def resident_mb() -> float:
    """Return the memory of this process."""
    import psutil
    return float(psutil.Process().memory_info().rss / 1e6)


def main() -> None:
    """Measure and print."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    with archive(count) as bags:
        by_loop(bags[:5])
        loop = timed(lambda: by_loop(bags))
        print(f'{count} bags, plain loop: {count / loop:.0f} bags/s')
        for workers, kill in ((1, False), (2, False), (2, True)):
            with client_of(None, workers) as client:
                by_workers(client, bags[:5])
                begin = time.perf_counter()
                by_workers(client, bags, kill=kill)
                took = time.perf_counter() - begin
                memory = max(client.run(resident_mb).values())
            name = f'{workers} workers' + (', one killed' if kill else '')
            print(f'{name}: {count / took:.0f} bags/s, {took / loop:.2f} of the loop, '
                  f'{memory:.0f} MB a worker')

    tree = moving(edges=4, rate_hz=100, seconds=60).snapshot()
    frames = 'map', 'camera'
    stamps = stamps_at_rate(tree, *frames, 100_000 / 60)
    one_by_one = timed(lambda: [tree.lookup(*frames, stamp) for stamp in stamps.tolist()])
    many = timed(lambda: trajectory(tree, *frames, stamps))
    taken = trajectory(tree, *frames, stamps)
    print(f'{len(stamps)} stamps over five edges: {many:.2f} s, {many / one_by_one:.3f} of one '
          'lookup a stamp; written as '
          + ', '.join(f'{form}: {timed(lambda form=form: FORMATS[form](taken)):.2f} s'  # type: ignore[misc]
                      for form in ('tum', 'csv', 'npz')))


if __name__ == '__main__':
    main()
