# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A node with a control loop: ``python -m benchmark.processes.control_loop WAY``.

It looks up slightly past poses at a fixed rate while /tf arrives. The results show the effect
of the listener on the node. WAY is one of ``WAYS``.
"""

import functools
import sys
import time
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.time import Time
import tf_tree_py

from ..looping import run_loop
from ..rows import OURS, SHARED, TF2_ROS
from ..worker import serve

# How long to wait for the process that shares the tree.
_PATIENCE_S = 20.0


def _ours(node: Node) -> tuple[Any, Any]:
    buffer = tf_tree_py.Buffer()
    return buffer, tf_tree_py.TransformListener(buffer, node)


def _tf2_ros(node: Node) -> tuple[Any, Any]:
    import tf2_ros
    buffer = tf2_ros.Buffer()
    return buffer, tf2_ros.TransformListener(buffer, node, spin_thread=True)


def _shared(node: Node) -> tuple[Any, Any]:
    buffer = tf_tree_py.Buffer(shared=_PATIENCE_S)
    return buffer, tf_tree_py.TransformListener(buffer, node)


WAYS = {OURS: _ours, TF2_ROS: _tf2_ros, SHARED: _shared}


class ControlLoop:
    """One listener, and a loop in the main thread."""

    def __init__(self, way: str, node: Node) -> None:
        self._buffer, self._listener = WAYS[way](node)

    def receives(self, target: str, source: str) -> bool:
        """Return whether there is a transform between two frames."""
        return bool(self._buffer.can_transform(target, source, Time()))

    def run(self, target: str, source: str, rate_hz: float, behind_s: float,
            seconds: float, listens: bool) -> dict[str, float]:
        """
        Look up at a rate; return the measurements.

        :param behind_s: how much older than the present time the stamps are.
        :param listens: False: stop listening first. The stamps are then in the interval that is
            this much older than the newest sample.
        """
        newest = None
        if not listens:
            newest = self._buffer.get_latest_common_time(target, source).nanoseconds
            self._listener.unregister()
        behind = round(behind_s * 1e9)

        def stamp(number: int) -> Time:
            present = time.time_ns() if newest is None else newest + number
            return Time(nanoseconds=present - behind)

        return run_loop(stamp, functools.partial(
            self._buffer.lookup_transform, target, source), rate_hz, seconds)


def main() -> None:
    """Run one loop."""
    rclpy.init()
    loop = ControlLoop(sys.argv[1], Node('benchmark_control_loop'))
    serve({'receives': loop.receives, 'run': loop.run})
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
