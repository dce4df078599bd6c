# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Writers of a shared tree that are killed, each before another line of the room runs.

python killed_writers.py prints what readers found afterwards, as JSON. It has no other thread, so
it may fork: to start Python anew for each of hundreds of deaths would take minutes.
"""

from functools import partial
import json
import os
from pathlib import Path
import signal
import sys

import numpy as np
from sharing_trees import new_place, SharingBuffer
from tf_tree_py import BufferCore, from_seconds
from tf_tree_py.core.stamp import FOREVER
from tf_tree_py.shared import memory
from tf_tree_py.shared.memory import Memory
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import SharedTree
from tf_tree_py.shared.sharing import share

CACHE_TIME = from_seconds(1.0)
MS = 10 ** 6
ROOM = str(Path(memory.__file__).parent)


def pose(number):
    return float(number), 0.0, 0.0, 0.0, 0.0, 0.6, 0.8


def insert(parent, child, stamp, number, buffer, **named):
    buffer.insert(parent, child, stamp * MS, pose(number), strict=False, **named)


def insert_track(parent, child, first, count, buffer):
    stamps = first * MS + np.arange(count) * (MS // 10)
    buffer.insert_track(parent, child, stamps, [pose(number) for number in range(count)],
                        strict=False)


def insert_both(first, buffer):
    buffer.insert_many(
        [('map', 'odom', first * MS, pose(1)), ('odom', 'base', first * MS, pose(2))])


# Each makes one new state: new edges, samples behind others and between them, full blocks, a file
# that grows, memory that is used again, and all that changes the tree.
CHANGES = [
    partial(insert, 'map', 'fixed', 0, 1, static=True),
    partial(insert, 'map', 'odom', 1000, 1),
    partial(insert, 'map', 'odom', 1010, 2),
    partial(insert, 'map', 'odom', 1005, 3),
    partial(insert, 'odom', 'base', 1000, 4),
    partial(insert_track, 'map', 'odom', 1011, 60),
    partial(insert_both, 1020),
    partial(insert, 'map', 'odom', 1021, 5),
    partial(insert_track, 'odom', 'base', 1030, 6000),
    partial(insert_both, 1700),
    partial(insert, 'fixed', 'odom', 1701, 6),
    partial(insert, 'map', 'odom', 1702, 7, authority='another'),
    partial(insert, 'map', 'odom', 1700, 8),
    *[partial(insert, 'odom', 'base', 1690 + number, number) for number in range(4)],
    lambda buffer: buffer.remove_frame('base'),
    partial(insert, 'odom', 'base', 1710, 9),
    lambda buffer: buffer.clear(),
    *[partial(insert, 'map', f'f{number}', 1800, 1) for number in range(10)],
]


def contents(tree):
    """Return what a tree has: its edges, and a few of their samples."""
    return [tree.frames(), tree.edges(), [
        [(stamp, tree.lookup_at(edge.parent, edge.child, stamp))
         for stamp in tree.stamps_of(edge.child).tolist()[::97]]
        for edge in tree.edges() if not edge.static]]


def expected():
    """Return the contents before the first change, and after each."""
    buffer = BufferCore(CACHE_TIME)
    states = [contents(buffer)]
    for change in CHANGES:
        change(buffer)
        states.append(contents(buffer))
    return states


def write(domain_id, at_line, done, begin):
    """Make all changes, one byte for each, and call a function before each line of the room."""
    def trace(frame, event, argument):
        if not frame.f_code.co_filename.startswith(ROOM):
            return None
        if event == 'line':
            at_line(frame.f_code.co_filename, frame.f_lineno)
        return trace

    Memory.keep_s = 0.0  # memory is used again at once
    buffer = SharingBuffer(CACHE_TIME)
    share(buffer, Place(domain_id))
    os.write(done, b'.')
    os.read(begin, 1)
    sys.settrace(trace)
    for change in CHANGES:
        change(buffer)
        os.write(done, b'.')
    sys.settrace(None)


class Death:
    """Kills this process before one of its lines."""

    def __init__(self, line):
        self.left = line

    def __call__(self, file, line):
        if self.left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        self.left -= 1


class Lines:
    """Notes when each line runs the first time, and the last."""

    def __init__(self):
        self.count = 0
        self.first, self.last = {}, {}

    def __call__(self, file, line):
        self.first.setdefault((file, line), self.count)
        self.last[file, line] = self.count
        self.count += 1


def child(run):
    """Run a function in a child process, and return its number and a pipe to read from."""
    pipe, to_pipe = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(pipe)
        run(to_pipe)
        os._exit(0)
    os.close(to_pipe)
    return pid, pipe


def read_all(pipe):
    parts = []
    while part := os.read(pipe, 4096):
        parts.append(part)
    os.close(pipe)
    return b''.join(parts)


def interesting_lines(domain_id):
    """Return when each line of the room runs the first time, and the last."""
    def run(to_pipe):
        lines = Lines()
        with open(os.devnull, 'r+b', buffering=0) as nothing:
            write(domain_id, lines, nothing.fileno(), nothing.fileno())
        with open(to_pipe, 'w') as file:
            json.dump(sorted({*lines.first.values(), *lines.last.values()}), file)

    pid, pipe = child(run)
    lines = json.loads(read_all(pipe))
    os.waitpid(pid, 0)
    return lines


def found_after(domain_id, line):
    """Return how many changes a writer had made when it died, and what a reader finds then."""
    begin, to_begin = os.pipe()
    pid, done = child(lambda to_done: write(domain_id, Death(line), to_done, begin))
    os.read(done, 1)
    with SharedTree(domain_id=domain_id) as tree:
        os.write(to_begin, b'.')
        made = len(read_all(done))
        assert os.waitpid(pid, 0)[1] == signal.SIGKILL
        # What the writer left must be readable, although lookups raise an error then.
        tree.attachment.check = lambda: False
        tree.attachment.alive_until = FOREVER
        found = contents(tree)
    os.close(begin)
    os.close(to_begin)
    return made, found


def main():
    """Kill writers, and print how many, and before which lines the result was wrong."""
    states, wrong = expected(), []
    with new_place() as domain_id:
        lines = interesting_lines(domain_id)
        for line in lines:
            made, found = found_after(domain_id, line)
            if found not in states[made:made + 2]:
                wrong.append((line, made))
    print(json.dumps({'killed': len(lines), 'last made': made, 'wrong': wrong}))


if __name__ == '__main__':
    main()
