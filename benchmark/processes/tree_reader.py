# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Look up in a tree in shared memory: ``python -m benchmark.processes.tree_reader WAY NAME``.

WAY is one of ``WAYS``; NAME is the number that its writer uses.
"""

from collections.abc import Callable
import functools
import sys
import time
from typing import Any

from rclpy.duration import Duration
from tf_tree_py import Buffer, BufferCore, SharedTree
from tf_tree_py.ros.messages.convert import time_message
from tf_tree_py.shared.attachment import Attachment
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import attach

from ..looping import run_loop
from ..rows import OWN, RUST, SHARED
from ..timing import time_each, time_one
from ..worker import serve

_PATIENCE_S = 20.0
_Lookup = Callable[[int], object]


class OurReader:
    """The shared tree."""

    def __init__(self, name: int) -> None:
        self._name = name
        self._tree: Any = SharedTree(domain_id=name, wait_s=_PATIENCE_S)
        self._buffer = Buffer()
        attach(self._buffer, Attachment(Place(name)))

    def lookup(self, target: str, source: str) -> _Lookup:
        """Return the lookup between two frames, by its stamp; 0 is the latest."""
        return functools.partial(self._tree.lookup, target, source)

    def message(self, target: str, source: str, stamp: int) -> Callable[[], object]:
        """Return a lookup as in a node, for a message."""
        return functools.partial(
            self._buffer.lookup_transform, target, source, time_message(stamp))

    def newest(self) -> int:
        """Return the stamp of the newest samples, approximately."""
        return time.time_ns()

    def attach(self) -> None:
        """Attach once more, and detach."""
        with SharedTree(domain_id=self._name):
            pass

    def wait(self, stamp: int) -> float:
        """Wait for a stamp; return the monotonic time afterwards, seconds."""
        self._tree.lookup_within(_PATIENCE_S, 'frame_0', 'frame_1', stamp)
        return time.monotonic()


class OwnTree(OurReader):
    """A buffer in this process with the same samples, which do not change."""

    def __init__(self, name: int) -> None:
        with SharedTree(domain_id=name, wait_s=_PATIENCE_S) as shared:
            self._buffer = Buffer(Duration(nanoseconds=shared.cache_time))
            self._tree = BufferCore(shared.cache_time)
            still = shared.snapshot()
        for edge in still.edges():
            stamps = still.stamps_of(edge.child)[1:]  # one may expire with the last
            poses = still.lookup_many(edge.parent, edge.child, stamps)
            for tree in self._buffer, self._tree:
                tree.insert_track(edge.parent, edge.child, stamps, poses)

    def newest(self) -> int:
        """Return the stamp of the newest samples."""
        return int(self._tree.latest_common_time('frame_0', 'frame_1'))


class RustReader:
    """transform-tree's arena."""

    def __init__(self, name: int) -> None:
        import tf_tree
        self._open = lambda: tf_tree.open_arena(name=f'benchmark_{name}')
        self._tree = self._open()

    def lookup(self, target: str, source: str) -> _Lookup:
        """Return the lookup between two frames, by its stamp; 0 is the latest."""
        plan = self._tree.plan(target, source)

        def lookup(stamp: int) -> object:
            return plan.at(stamp or self._tree.span(target, source)[1], layout='quat')

        return lookup

    def newest(self) -> int:
        """Return the stamp of the newest samples, approximately."""
        return time.time_ns()

    def attach(self) -> None:
        """Attach once more, and detach."""
        self._open()


WAYS = {SHARED: OurReader, OWN: OwnTree, RUST: RustReader}


class Reader:
    """A process that looks up."""

    def __init__(self, way: str, name: int) -> None:
        self._reader: Any = WAYS[way](name)

    def lookup_s(self, depth: int, behind_s: float | None, count: int,
                 is_message: bool) -> float:
        """
        Return the time of a lookup over so many edges, in a tight loop, seconds.

        :param behind_s: how much older than the present time its stamp is; None: the latest.
        :param is_message: ask a ROS buffer for a message, not a tree for a pose.
        """
        ends = 'frame_0', f'frame_{depth}'
        stamp = 0 if behind_s is None else self._reader.newest() - round(behind_s * 1e9)
        return time_each(self._reader.message(*ends, stamp) if is_message else
                         functools.partial(self._reader.lookup(*ends), stamp), count)

    def attach_s(self) -> float:
        """Return the time to attach, seconds."""
        return time_one(self._reader.attach)

    def wait(self, stamp: int) -> float:
        """Wait for a stamp; return the monotonic time afterwards, seconds."""
        return float(self._reader.wait(stamp))

    def loop(self, depth: int, rate_hz: float, behind_s: float,
             seconds: float) -> dict[str, float]:
        """Look up at a rate; return the measurements."""
        return run_loop(lambda _: time.time_ns() - round(behind_s * 1e9),
                        self._reader.lookup('frame_0', f'frame_{depth}'), rate_hz, seconds)


def main() -> None:
    """Look up until the input ends."""
    reader = Reader(sys.argv[1], int(sys.argv[2]))
    serve({'lookup_s': reader.lookup_s, 'attach_s': reader.attach_s, 'loop': reader.loop,
           'wait': reader.wait})


if __name__ == '__main__':
    main()
