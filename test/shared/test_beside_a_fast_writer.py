# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reading while another process writes as fast as it can, on another processor."""

import json
import os
from pathlib import Path
import subprocess
import sys

import killed_writers
import pytest
from sharing_trees import new_place
from tf_tree_py import BufferCore
from tf_tree_py.shared.shared_tree import SharedTree

TESTS = Path(__file__).parents[1]
MS = 10 ** 6
LAST = 12_000

# Each message has three edges with the same stamp, so each state has all three of it. A fourth
# edge has late samples, so it gets a new block with each message, and memory is used again soon.
WRITER = """
import sys
from sharing_trees import SharingBuffer
from test_beside_a_fast_writer import edges_at, LAST, MS
from tf_tree_py import from_seconds
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.sharing import share

buffer = SharingBuffer(from_seconds(0.5))
share(buffer, Place(int(sys.argv[1])))
print('shares', flush=True)
for number in range(1, LAST + 1):
    buffer.insert_many(edges_at(number * MS))
    late = 2 * number * MS
    buffer.insert('map', 'late', late + 3, (late + 3.0, 0, 0, 0, 0, 0, 1))
    buffer.insert('map', 'late', late, (float(late), 0, 0, 0, 0, 0, 1))
sys.stdin.read()
"""


def edges_at(stamp):
    """Return samples that say their stamp, with rotations."""
    x = float(stamp // MS)
    return [('map', 'odom', stamp, (x, 1.0, 0.0, 0.6, 0.0, 0.0, 0.8)),
            ('odom', 'base', stamp, (0.0, x, 2.0, 0.0, 0.6, 0.0, 0.8)),
            ('base', 'camera', stamp, (3.0, 0.0, x, 0.0, 0.0, 0.6, 0.8))]


def expected(stamp):
    """Return map_T_camera at a stamp of a sample."""
    model = BufferCore()
    model.insert_many(edges_at(stamp))
    return model.lookup('map', 'camera', stamp)


@pytest.fixture
def fast_writer():
    with new_place() as domain_id:
        writer = subprocess.Popen(
            [sys.executable, '-c', WRITER, str(domain_id)], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True,
            env={**os.environ, 'PYTHONPATH': f'{TESTS}:{TESTS / "shared"}'})
        assert writer.stdout.readline() == 'shares\n'
        yield domain_id
        writer.communicate()


def test_each_answer_is_that_of_one_message(fast_writer):
    with SharedTree(domain_id=fast_writer, wait_s=1.0) as tree:
        stamp = 0
        while stamp < LAST * MS:
            if 'camera' not in tree.frames():
                continue
            stamp, pose = tree.lookup_stamped('map', 'camera')
            assert pose == expected(stamp)
            snapshot = tree.snapshot()
            for edge in snapshot.edges():
                for each in {edge.oldest, edge.latest}:
                    found = snapshot.lookup(edge.parent, edge.child, each)
                    if edge.child == 'late':
                        assert found.x == each
                    else:
                        assert found == {child: pose for _, child, _, pose in edges_at(each)}[
                            edge.child]
            stamps = snapshot.stamps_of('odom').tolist()
            assert stamps == list(range(stamps[0], stamps[-1] + 1, MS))
            assert stamps[0] == MS or len(stamps) >= 501


def test_writers_that_are_killed_before_any_line():
    """A reader finds all of a change, or nothing of it."""
    program = subprocess.run(
        [sys.executable, killed_writers.__file__], check=True, capture_output=True, text=True,
        env={**os.environ, 'PYTHONPATH': f'{TESTS}:{TESTS.parent}'})
    result = json.loads(program.stdout)
    assert result['wrong'] == []
    assert result['killed'] > 200
    assert result['last made'] >= len(killed_writers.CHANGES) - 1
