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
A buffer that is given very much: ``python -m benchmark.processes.hoard``.

In a process of its own, so that the process's memory is the buffer's.
"""

import os

from tf_tree_py.core.arrivals.wire import WireReader
from tf_tree_py.core.buffer.buffer_core import BufferCore

from .. import motion, wire
from ..worker import serve

_EDGES = 10
_TRANSFORMS = 38
_RATE_HZ = 500


def hoard(samples: int) -> float:
    """Return how many bytes of memory a sample takes, when there are so many."""
    feed = _Feed(_EDGES, cache_s=1e6)
    feed.take(samples // _EDGES // 100)
    before, taken = resident_bytes(), feed.taken
    feed.take(samples // _EDGES - taken // _EDGES)
    return (resident_bytes() - before) / (feed.taken - taken)


def traffic(seconds: int) -> list[int]:
    """Return the bytes of memory after each of so many seconds of traffic, simulated."""
    feed = _Feed(_TRANSFORMS, cache_s=10.0)
    resident = []
    for _ in range(seconds):
        feed.take(_RATE_HZ)
        resident.append(resident_bytes())
    return resident


def resident_bytes() -> int:
    """Return how much memory this process has."""
    with open('/proc/self/statm') as file:
        return int(file.read().split()[1]) * os.sysconf('SC_PAGESIZE')


class _Feed:
    """Messages as from the wire, into a buffer, as fast as it takes them."""

    def __init__(self, edges: int, cache_s: float) -> None:
        self.taken = 0
        self._edges = motion.chain(edges).edges
        self._poses = [motion.pose_at(edge, motion.START) for edge in self._edges]
        self._buffer = BufferCore(int(cache_s * 1e9))
        self._reader = WireReader()
        self._sent = 0

    def take(self, messages: int) -> None:
        """Go on for so many messages."""
        period = 1_000_000_000 // _RATE_HZ
        for _ in range(messages):
            stamp = motion.START + self._sent * period
            self._sent += 1
            message = wire.message(self._edges, [stamp] * len(self._edges), self._poses)
            incidents = self._buffer.insert_batch(self._reader.read(message))
            assert not incidents
        self.taken = self._buffer.statistics().accepted


if __name__ == '__main__':
    serve({'hoard': hoard, 'traffic': traffic})
