# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A buffer with very many samples: ``python -m benchmark.processes.hoard``.

Runs in a separate process, so that the process's memory is the buffer's.
"""

from collections.abc import Callable
import ctypes
import gc
import os

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.messages.wire import WireReader
from tf_tree_py.core.stamp import UNLIMITED

from .. import motion, wire
from ..rows import JAZZY, OURS
from ..worker import serve

_EDGES = 10
_TRANSFORMS = 38
_RATE_HZ = 500
# So that the first insertion imports and allocates nothing more.
_WARM_UP = 1000
_FOREVER_S = 1e6


def hoard(samples: int) -> float:
    """Return the bytes of memory per sample, measured with this number of samples."""
    feed = _Feed(_EDGES, cache_s=1e6)
    feed.insert(samples // _EDGES // 100)
    before, taken = resident_bytes(), feed.taken
    feed.insert(samples // _EDGES - taken // _EDGES)
    return (resident_bytes() - before) / (feed.taken - taken)


def spread_out(way: str, each: int, samples: int) -> float:
    """
    Return the bytes of memory per sample of a tree with the same number of samples in each edge.

    The edges with their names are included.

    :param way: a contestant, as in the report.
    :param each: samples of each edge.
    :param samples: of all edges together.
    """
    edges = motion.wide(samples // each + 1).edges
    insert = _INSERTERS[way]()
    insert_all(_INSERTERS[way](), edges[:1], _WARM_UP)
    # Otherwise the samples would first fill what the imports and the warm-up have freed.
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    before = resident_bytes()
    insert_all(insert, edges, each)
    return (resident_bytes() - before) / (len(edges) * each)


def insert_all(insert: Callable[[motion.Edge, int, motion.Pose], object],
               edges: list[motion.Edge], each: int) -> None:
    for edge in edges:
        pose = motion.pose_at(edge, motion.START)
        for number in range(each):
            insert(edge, edge.stamp_of(number), pose)


def _into_core() -> Callable[[motion.Edge, int, motion.Pose], object]:
    buffer = BufferCore(UNLIMITED)
    return lambda edge, stamp, pose: buffer.insert(edge.parent, edge.child, stamp, pose)


def _into_jazzy() -> Callable[[motion.Edge, int, motion.Pose], object]:
    from ..peers.jazzy import JazzyBuffer
    peer = JazzyBuffer()
    peer.reset(motion.chain(1), _FOREVER_S)
    return lambda edge, stamp, pose: peer.insert(peer.message(edge, stamp, pose))


_INSERTERS = {OURS: _into_core, JAZZY: _into_jazzy}


def traffic(seconds: int) -> list[int]:
    """Return the bytes of memory after each of a number of seconds of simulated traffic."""
    feed = _Feed(_TRANSFORMS, cache_s=10.0)
    resident = []
    for _ in range(seconds):
        feed.insert(_RATE_HZ)
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

    def insert(self, messages: int) -> None:
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
    serve({'hoard': hoard, 'spread_out': spread_out, 'traffic': traffic})
