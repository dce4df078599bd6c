# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Trees that tests share: each at a place of its own, which is empty afterwards."""

from contextlib import contextmanager
import itertools
import os
from pathlib import Path
import signal
import subprocess
import sys

from tf_tree_py import BufferCore
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import share, SharingTree

_numbers = itertools.count()
TESTS = str(Path(__file__).parent)


class SharingBuffer(BufferCore):
    """A buffer whose tree can be shared."""

    tree_class = SharingTree


@contextmanager
def new_place():
    """Yield the domain of a place that no other process uses, and remove its files."""
    domain_id = 1_000_000 + 1_000_000 * next(_numbers) + os.getpid()
    try:
        yield domain_id
    finally:
        remove_files(Place(domain_id))


def files_of(place):
    """Return the files of a place, finished or not, and those of its domain's other topics."""
    return [path for pattern in ('{}.*', '.{}.*', '{}-*')
            for path in place.memory.parent.glob(pattern.format(place.memory.stem))]


def remove_files(place):
    """Remove the files of a place, and those of other topics of its domain."""
    for path in files_of(place):
        path.unlink(missing_ok=True)


@contextmanager
def shared(buffer):
    """Yield the domain in which the tree of a buffer is shared, and what shares it."""
    with new_place() as domain_id, share(buffer, Place(domain_id)) as sharing:
        yield domain_id, sharing


def error_of(ask):
    """Return the text of the SharedTreeException that a call raises; '' if it raises none."""
    try:
        ask()
    except SharedTreeException as error:
        return str(error)
    return ''


# Inserts one sample, and hangs after a line of input.
_WRITER = """
import ctypes, sys
from sharing_trees import SharingBuffer
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import share
buffer = SharingBuffer()
sharing = share(buffer, Place(int(sys.argv[1])))
buffer.insert('map', 'odom', 1_000_000, (float(sys.argv[2]), 2.0, 3.0, 0.0, 0.0, 0.6, 0.8))
print('shares', flush=True)
sys.stdin.readline()
ctypes.PyDLL(None).pause()  # no other thread runs: it holds the interpreter
"""


class WriterProcess:
    """Another process, which shares a tree with one sample."""

    def __init__(self, domain_id, x=1.0):
        self._process = subprocess.Popen(
            [sys.executable, '-c', _WRITER, str(domain_id), str(x)], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, env={**os.environ, 'PYTHONPATH': TESTS})
        self.pid = self._process.pid
        assert self._process.stdout.readline() == 'shares\n'

    def signal(self, number):
        self._process.send_signal(number)

    def hang(self):
        self._process.stdin.write('\n')
        self._process.stdin.flush()

    def close(self):
        self._process.send_signal(signal.SIGKILL)
        self._process.communicate()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
