# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A buffer with very many samples: ``python -m benchmark.processes.hoard``.

Runs in a separate process, so that the process's memory is the buffer's.
"""

import os

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.messages.wire import WireReader

from .. import motion, wire
from ..worker import serve

_EDGES = 10
_TRANSFORMS = 38
_RATE_HZ = 500


def hoard(samples: int) -> float:
    """Return the bytes of memory per sample, measured with this number of samples."""
    feed = _Feed(_EDGES, cache_s=1e6)
    feed.take(samples // _EDGES // 100)
    before, taken = resident_bytes(), feed.taken
    feed.take(samples // _EDGES - taken // _EDGES)
    return (resident_bytes() - before) / (feed.taken - taken)


def traffic(seconds: int) -> list[int]:
    """Return the bytes of memory after each of a number of seconds of simulated traffic."""
    feed = _Feed(_TRANSFORMS, cache_s=10.0)
    resident = []
    for _ in range(seconds):
        feed.take(_RATE_HZ)
        resident.append(resident_bytes())
    return resident


def resident_bytes() -> int:
    """Return the resident memory of this process."""
    with open('/proc/self/statm') as file:
        return int(file.read().split()[1]) * os.sysconf('SC_PAGESIZE')


class _Feed:
    """Serialized messages, inserted into a buffer as fast as possible."""

    def __init__(self, edges: int, cache_s: float) -> None:
        self.taken = 0
        self._edges = motion.chain(edges).edges
        self._poses = [motion.pose_at(edge, motion.START) for edge in self._edges]
        self._buffer = BufferCore(int(cache_s * 1e9))
        self._reader = WireReader()
        self._sent = 0

    def take(self, messages: int) -> None:
        """Insert this number of further messages."""
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
