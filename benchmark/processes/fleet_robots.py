# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Simulated robots of a fleet: ``python -m benchmark.processes.fleet_robots ROUTER``.

A robot has 40 frames in a chain; 25 of them move.
"""

from functools import partial
import math
import sys
import threading

from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.fleet import configuration, open_session
from tf_tree_py.fleet.robot_publisher import drive, SimulatedRobot
import zenoh

from ..worker import serve

MOVING, STATIC = 25, 15


def robot(number: int) -> SimulatedRobot:
    """Return a robot whose frames are a chain, the moving ones first."""
    names = ['map', *(f'link_{frame}' for frame in range(MOVING + STATIC))]
    edges = list(zip(names, names[1:], strict=False))

    def moving(stamp: int) -> list[Sample]:
        half = 0.5 * math.sin(stamp * 1e-9 + number)
        pose = (math.cos(stamp * 1e-9), 0.1, 0.2, 0.0, 0.0, math.sin(half), math.cos(half))
        return [Sample(*edge, stamp, pose) for edge in edges[:MOVING]]

    fixed = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return SimulatedRobot(
        f'robot{number}', [Sample(*edge, 0, fixed) for edge in edges[MOVING:]], moving)


def send_for_a_while(session: zenoh.Session, count: int, rate_hz: float, seconds: float) -> int:
    """Send as a number of robots for a time; return the number of messages sent."""
    ended = threading.Event()
    threading.Timer(seconds, ended.set).start()
    return drive(session, [robot(number) for number in range(count)], rate_hz, ended)


if __name__ == '__main__':
    with open_session(configuration(sys.argv[1]), 10.0) as session:
        serve({'drive': partial(send_for_a_while, session)})
