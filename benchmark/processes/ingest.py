# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Read one bag in one of several ways: ``python -m benchmark.processes.ingest``.

Each reading runs in a new process, so that the process's memory is the recording's.
"""

from collections.abc import Callable, Iterator
import itertools
from pathlib import Path
import resource
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores
from tf_tree_py import load
from tf_tree_py.bag import open_bag
import tf_tree_py.bag.files.file_formats  # noqa: F401 - else the first bag includes the import

from .hoard import resident_bytes
from ..timing import cpu_clock
from ..worker import serve

# The simple loop is so slow that a part of the bag is enough.
_LOOP_MESSAGES = 3_000


def ours(path: str) -> dict[str, float]:
    """Open a bag; return the seconds and the bytes of memory that it takes."""
    before = resident_bytes()
    kept: list[Any] = []
    seconds = _time(lambda: kept.append(open_bag(path)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {'seconds': seconds, 'resident': resident_bytes() - before, 'peak': peak - before,
            'transforms': kept[0].statistics.accepted}


def rust(path: str) -> dict[str, float]:
    """Read the bag with the Rust tree."""
    import tf_tree
    kept: list[Any] = []
    return {'seconds': _time(lambda: kept.append(tf_tree.ingest_bag(Path(path))))}


def raw(path: str) -> dict[str, float]:
    """Iterate over all raw messages with rosbags."""
    return {'seconds': _time(lambda: [None for _ in _messages(path)])}


def loop(path: str) -> dict[str, float]:
    """Deserialize each message, like a script that needs two transforms."""
    types = get_typestore(Stores.ROS2_JAZZY)
    poses: dict[str, list[Any]] = {}

    def read() -> None:
        for connection, _, data in itertools.islice(_messages(path), _LOOP_MESSAGES):
            message: Any = types.deserialize_cdr(data, connection.msgtype)
            for transform in message.transforms:
                poses.setdefault(transform.child_frame_id, []).append(transform)

    seconds = _time(read)
    return {'seconds': seconds, 'transforms': sum(map(len, poses.values()))}


def saved(path: str) -> dict[str, float]:
    """Open a saved tree, and look up one transform."""
    def look() -> None:
        buffer = load(path)
        buffer.lookup('frame_0', 'frame_5')

    return {'seconds': _time(look)}


def save(path: str, target: str) -> None:
    """Save a bag."""
    open_bag(path).save(target)


def _time(call: Callable[[], object]) -> float:
    """Return the CPU seconds that a call takes; all contestants use one thread."""
    begin = cpu_clock()
    call()
    return cpu_clock() - begin


def _messages(path: str) -> Iterator[Any]:
    with Reader(path) as reader:
        yield from reader.messages()


if __name__ == '__main__':
    serve({'ours': ours, 'rust': rust, 'raw': raw, 'loop': loop, 'saved': saved,
           'save': save})
