# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The delay from the arrival of a transform to the return of a blocked lookup."""

from collections.abc import Iterator
from contextlib import ExitStack
import queue
import random
import statistics
import threading
import time

from rclpy.duration import Duration

from .listening import start
from .. import motion
from ..effort import Effort
from ..peers.finding import Contestants
from ..peers.ours import OurBuffer
from ..rows import DEBIAN, OURS, PLAIN, Row, scaled, TF2_ROS
from ..timing import clock, Rounds

_P50_MS = 0.3
_P99_MS = 2.0
_TURNS = 5


def waiting(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure within a process, and from another process over DDS."""
    yield from _rows('in process', _in_process(contestants, effort.waits))
    yield from _rows('over DDS', _over_dds(contestants, effort.waits))


def _rows(where: str, waits: list[dict[str, list[float]]]) -> Iterator[Row]:
    """Return the median and the 99th percentile of each turn."""
    for name, pick, target in (('p50', statistics.median, _P50_MS), ('p99', _p99, _P99_MS)):
        values: Rounds = {way: [pick(turn[way]) for turn in waits] for way in waits[0]}
        row = Row('wait', f'{where}, {name}', 'ms', scaled(values, 1e3))
        row.judge(OURS, target)
        row.compare(OURS, DEBIAN, unit='x polling as tf2 does')
        row.compare(OURS, PLAIN)
        row.compare(OURS, TF2_ROS)
        yield row


def _p99(values: list[float]) -> float:
    return statistics.quantiles(values, n=100, method='inclusive')[98]


def _in_process(contestants: Contestants, count: int) -> list[dict[str, list[float]]]:
    turns = []
    for _ in range(_TURNS):
        turns.append({OURS: _wait_often(count // _TURNS)})
        if contestants.debian:
            # Polling takes ten times as long, so a few are enough.
            turns[-1][DEBIAN] = contestants.debian.worker.call(
                'wait_often', count=count // _TURNS // 4)
    return turns


def _wait_often(count: int) -> list[float]:
    """Return the seconds from each of many insertions to the return of a blocked lookup."""
    edge = motion.chain(1).edges[0]
    peer = OurBuffer()
    peer.reset(motion.chain(1), 10.0)
    samples: queue.SimpleQueue[int] = queue.SimpleQueue()
    returned: queue.SimpleQueue[float] = queue.SimpleQueue()

    def wait() -> None:
        for _ in range(count):
            peer.buffer.lookup_transform(
                edge.parent, edge.child, peer.time(edge.stamp_of(samples.get())),
                Duration(seconds=10.0))
            returned.put(clock())

    waiting_thread = threading.Thread(target=wait)
    waiting_thread.start()
    waits = []
    for sample in range(count):
        stamp = edge.stamp_of(sample)
        message = peer.message(edge, stamp, motion.pose_at(edge, stamp))
        samples.put(sample)
        time.sleep(random.uniform(0.002, 0.006))
        begin = clock()
        peer.insert(message)
        waits.append(returned.get() - begin)
    waiting_thread.join()
    return waits


def _over_dds(contestants: Contestants, count: int) -> list[dict[str, list[float]]]:
    ways = [OURS, PLAIN, *([TF2_ROS] if contestants.tf2_ros else [])]
    return [{way: _wait_for_another(way, count // _TURNS) for way in ways}
            for _ in range(_TURNS)]


def _wait_for_another(way: str, count: int) -> list[float]:
    """Return the seconds from publication in another process."""
    with ExitStack() as processes:
        publisher = processes.enter_context(start('publisher'))
        waiter = processes.enter_context(start('waiter', way))
        while not waiter.call('publishers'):
            time.sleep(0.05)
        # Both processes must discover each other, not only one.
        time.sleep(0.5)
        waiter.begin('wait_often', count=count)
        publisher.call('send_timed', count=count)
        return waiter.end()
