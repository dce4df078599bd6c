# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Write a tree in shared memory, without ROS: ``python -m benchmark.processes.tree_writer WAY NAME``.

WAY is one of ``WAYS``; NAME is a number that its readers use, too.
"""

from itertools import count
import sys
import threading
import time

import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core import Sample
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import share, SharingTree

from .. import motion
from ..rows import RUST, SHARED
from ..worker import serve

# Poses of each edge; after these they repeat.
_PREPARED = 1000


class _Buffer(BufferCore):
    """A buffer whose tree can lie in shared memory."""

    tree_class = SharingTree


class OurWriter:
    """A buffer whose tree is shared."""

    def __init__(self, name: int, edges: list[motion.Edge], history_s: float, _: float) -> None:
        self._edges = edges
        self._buffer = _Buffer(round(history_s * 1e9))
        self.sharing = share(self._buffer, Place(name))

    def fill(self, stamps: list[int], poses: list[list[motion.Pose]]) -> None:
        """Insert many samples of each edge."""
        for edge, of_edge in zip(self._edges, poses, strict=True):
            self._buffer.insert_track(edge.parent, edge.child, stamps, of_edge)

    def insert(self, stamp: int, poses: list[motion.Pose]) -> None:
        """Insert a sample of each edge, as those of one message."""
        self._buffer.insert_many([
            Sample(edge.parent, edge.child, stamp, pose)
            for edge, pose in zip(self._edges, poses, strict=True)])


class RustWriter:
    """transform-tree's arena, whose rings have a fixed size."""

    def __init__(self, name: int, edges: list[motion.Edge], history_s: float,
                 rate_hz: float) -> None:
        import tf_tree
        self._tree = tf_tree.open_arena(
            name=f'benchmark_{name}', mode='rw', interp='lerpslerp',
            create=[(edge.parent, edge.child) for edge in edges],
            capacity=1 << round(history_s * rate_hz).bit_length())
        self._publishers = [self._tree.publisher(edge.child, edge.parent) for edge in edges]

    def fill(self, stamps: list[int], poses: list[list[motion.Pose]]) -> None:
        """Insert many samples of each edge."""
        for publisher, of_edge in zip(self._publishers, poses, strict=True):
            publisher.push_many(np.array(stamps), np.array(list(map(_as_rust, of_edge))))

    def insert(self, stamp: int, poses: list[motion.Pose]) -> None:
        """Insert a sample of each edge."""
        for publisher, pose in zip(self._publishers, poses, strict=True):
            publisher.push(stamp, _as_rust(pose))


def _as_rust(pose: motion.Pose) -> list[float]:
    x, y, z, qx, qy, qz, qw = pose
    return [qw, qx, qy, qz, x, y, z]


WAYS: dict[str, type[OurWriter | RustWriter]] = {SHARED: OurWriter, RUST: RustWriter}


class Stream:
    """All edges of a chain, at a rate."""

    def __init__(self, way: str, name: int) -> None:
        self._way, self._name = way, name
        self._over = threading.Event()

    def begin(self, transforms: int, rate_hz: float, history_s: float) -> None:
        """Share a tree with a full window, and no more."""
        edges = motion.chain(transforms).edges
        self._writer: OurWriter | RustWriter = WAYS[self._way](
            self._name, edges, history_s, rate_hz)
        self._rate_hz, self._history_s = rate_hz, history_s
        self._rows = [[motion.pose_at(edge, edge.stamp_of(number)) for edge in edges]
                      for number in range(_PREPARED)]
        now, length = time.time_ns(), round(history_s * rate_hz)
        stamps = [now - round((length - number) / rate_hz * 1e9) for number in range(length)]
        self._writer.fill(stamps, [[self._rows[number % _PREPARED][at] for number in range(length)]
                                   for at in range(len(edges))])

    def run(self) -> None:
        """Insert at the rate from now on."""
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        began = time.monotonic()
        for number in count():
            if self._over.wait(max(0.0, began + number / self._rate_hz - time.monotonic())):
                return
            self.insert(time.time_ns(), number)

    def insert(self, stamp: int, number: int = 0) -> float:
        """Insert a sample of each edge; return the monotonic time before, seconds."""
        began = time.monotonic()
        self._writer.insert(stamp, self._rows[number % _PREPARED])
        return began

    def close(self) -> None:
        """Insert no more, and end sharing."""
        self._over.set()
        if isinstance(self._writer, OurWriter):
            self._writer.sharing.close()


def main() -> None:
    """Write until the input ends."""
    stream = Stream(sys.argv[1], int(sys.argv[2]))
    serve({'begin': stream.begin, 'run': stream.run, 'insert': stream.insert})
    stream.close()


if __name__ == '__main__':
    main()
