# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Robots that number what they send: ``python -m benchmark.processes.fleet_numbered ROUTER HISTORY``.

Each has a session of its own, as on a machine of its own. The stamps of its messages are numbers,
in nanoseconds, so a listener finds out which of them are missing.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
import resource
import sys
import time

from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import configuration, open_session, RobotPublisher

from ..worker import serve

FIRST = 'frame0'


def _resident() -> int:
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize()


class Robots:
    """Robots of this process, and the memory of what they keep."""

    def __init__(self, address: str, history: int, closing: ExitStack) -> None:
        self._address, self._history, self._closing = address, history, closing
        self._robots: list[RobotPublisher] = []

    def begin(self, names: Sequence[str]) -> None:
        """Connect robots."""
        for name in names:
            session = self._closing.enter_context(
                open_session(configuration(self._address), 10.0))
            self._robots.append(self._closing.enter_context(
                RobotPublisher(session, name, history=self._history)))

    def send(self, rate_hz: float, count: int, frames: int) -> dict[str, float]:
        """
        Send a number of messages per robot, all robots at the same moments.

        :return: the bytes of a message, and those that the process has grown by per message kept.
        """
        before, begin, data = _resident(), time.monotonic(), b''
        for number in range(count):
            time.sleep(max(0.0, begin + number / rate_hz - time.monotonic()))
            data = write([Sample('map', f'frame{frame}', number, IDENTITY)
                          for frame in range(frames)])
            for robot in self._robots:
                robot.send(data)
        kept = min(count, self._history) * len(self._robots)
        return {'bytes': len(data), 'grown_by': (_resident() - before) / kept}


if __name__ == '__main__':
    with ExitStack() as closing:
        robots = Robots(sys.argv[1], int(sys.argv[2]), closing)
        serve({'begin': robots.begin, 'send': robots.send})
