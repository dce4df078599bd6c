# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A node that looks up on a schedule: ``python -m benchmark.processes.tick_looker WAY``.

All such nodes look up the same stamps, the multiples of ``TICK``, at the same time: ``BEHIND``
after the stamp. So the failures of two nodes can be compared one by one. WAY is one of
``control_loop.WAYS``, or ``GUARDED``.
"""

import math
import sys
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
import tf_tree_py

from .control_loop import WAYS
from .. import motion
from ..motion import Edge, steady_pose
from ..rows import OURS
from ..worker import serve

TICK, BEHIND = 10_000_000, 50_000_000
GUARDED = 'guarded'
_TOLERANCE = 1e-3


def _guarded(node: Node) -> tuple[Any, Any]:
    """Return a buffer that refuses stamps from the future, and its listener."""
    buffer = tf_tree_py.Buffer(max_future=Duration(seconds=1.0))
    return buffer, tf_tree_py.TransformListener(buffer, node)


class TickLooker:
    """One listener, and lookups on a schedule in the main thread."""

    def __init__(self, way: str, node: Node) -> None:
        self.buffer, self.listener = {**WAYS, GUARDED: _guarded}[way](node)
        self._is_ours = way in (OURS, GUARDED)

    def receives(self, target: str, source: str) -> bool:
        """Return whether there is a transform between two frames."""
        return bool(self.buffer.can_transform(target, source, Time()))

    def run(self, first: int, count: int, target: str, source: str) -> dict[str, Any]:
        """
        Look up at the ticks of a schedule.

        :return: the ticks without an answer, and the times of a lookup, seconds.
        """
        missed, spent, late = [], [], []
        for tick in range(first, first + count):
            due = (tick * TICK + BEHIND) * 1e-9
            time.sleep(max(0.0, due - time.time()))
            late.append(time.time() - due)
            begin = time.perf_counter()
            try:
                self.buffer.lookup_transform(target, source, Time(nanoseconds=tick * TICK))
            except Exception:  # noqa: B902 - each package has its own classes
                missed.append(tick)
            spent.append(time.perf_counter() - begin)
        p50, p99 = np.percentile(spent, [50.0, 99.0]).tolist()
        return {'missed': missed, 'p50_s': p50, 'p99_s': p99, 'late_s': max(late)}

    def wrong(self, first: int, count: int, edges: int) -> int:
        """Return how many answers about a chain that ``send_true`` sends are wrong."""
        return sum(self._is_wrong(edge, tick * TICK) for edge in motion.chain(edges).edges
                   for tick in range(first, first + count))

    def _is_wrong(self, edge: Edge, stamp: int) -> bool:
        try:
            found = self.buffer.lookup_transform(
                edge.parent, edge.child, Time(nanoseconds=stamp)).transform.translation
        except Exception:  # noqa: B902
            return False
        return math.dist((found.x, found.y, found.z), steady_pose(stamp)[:3]) > _TOLERANCE

    def first_answer(self, target: str, source: str, after: int) -> float:
        """Return how long after a time there is newer data, seconds."""
        while self.buffer.get_latest_common_time(target, source).nanoseconds < after:
            time.sleep(0.001)
        return (time.time_ns() - after) * 1e-9

    def counts(self) -> dict[str, int]:
        """Return how many transforms were inserted and refused; our buffer only."""
        if not self._is_ours:
            return {}
        counted = self.buffer.statistics()
        return {'accepted': counted.accepted, 'refused': counted.refused,
                'frames': len(self.buffer.frames())}


def main() -> None:
    """Serve one node."""
    rclpy.init()
    looker = TickLooker(sys.argv[1], Node('benchmark_tick_looker'))
    serve({'receives': looker.receives, 'run': looker.run, 'wrong': looker.wrong,
           'first_answer': looker.first_answer, 'counts': looker.counts})
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
