# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Displays of buffers, snapshots, counts and errors, and their copies and pickles."""

import copy
import pickle
import threading

import numpy as np
import pytest
from tf_tree_py import BufferCore, Snapshot
from tf_tree_py.core import LATEST, LookupException, Pose, Statistics

SECOND = 10**9


@pytest.fixture
def buffer():
    buffer = BufferCore()
    for second in (10, 11, 14):
        buffer.insert('map', 'odom', second * SECOND, Pose(float(second)))
    buffer.insert('odom', 'base', 12 * SECOND, Pose())
    buffer.insert('base', 'camera', LATEST, Pose(), static=True)
    buffer.insert('base', 'lidar', LATEST, Pose(), static=True)
    buffer.insert('odom', 'ball', 12 * SECOND, Pose())
    buffer.insert('ceiling', 'lamp', LATEST, Pose(), static=True)
    return buffer


# --- one line


def test_repr_says_frames_edges_and_span(buffer):
    text = '8 frames, 6 edges (3 static), 10.000000000 to 14.000000000 s'
    assert repr(buffer) == f'<BufferCore: {text}>'
    assert repr(buffer.snapshot()) == f'<Snapshot: {text}>'


def test_repr_of_what_does_not_move_and_of_nothing():
    buffer = BufferCore()
    assert repr(buffer) == '<BufferCore: empty>'
    buffer.insert('map', 'base', LATEST, Pose(), static=True)
    assert repr(buffer) == '<BufferCore: 2 frames, 1 edge (1 static)>'
    buffer.insert('map', 'arm', 5, Pose())
    buffer.clear()
    assert repr(buffer) == '<BufferCore: 3 frames, 1 edge (1 static)>'


def test_statistics_print_what_is_not_zero():
    assert str(Statistics()) == '0 accepted, 0 refused, 0 frames'
    buffer = BufferCore()
    buffer.insert('map', 'base', 1, Pose())
    for _ in range(2):
        buffer.insert('map', 'map', 1, Pose())
    assert str(buffer.statistics()) == (
        '1 accepted, 2 refused, 2 frames; frame is its own parent: 2')


def test_repr_of_an_error_says_what_it_says(buffer):
    with pytest.raises(LookupException) as raised:
        buffer.lookup('map', 'nowhere')
    assert repr(raised.value) == f'LookupException({str(raised.value)!r})'
    assert '"nowhere" passed to' in repr(raised.value)
    assert repr(LookupException()) == "LookupException('')"


# --- the tree in a notebook


def test_notebook_shows_the_tree(buffer):
    title, tree = buffer._repr_html_().split('<pre>')
    assert title == f'<div>{repr(buffer)[1:-1]}</div>'
    assert tree == """\
map
└─ odom  3 samples in 4.000 s, the last at 14.000000000
   ├─ base  1 sample at 12.000000000
   │  ├─ camera  static
   │  └─ lidar  static
   └─ ball  1 sample at 12.000000000
ceiling
└─ lamp  static</pre>"""


def test_names_do_no_harm_in_a_notebook():
    buffer = BufferCore()
    for number, name in enumerate(['<script>', 'a\nb', '\x1b[31m', 'x' * 10**6]):
        buffer.insert('map & more', name, number, Pose())
    shown = buffer._repr_html_()
    assert '&lt;script&gt;' in shown and '<script>' not in shown
    assert 'map &amp; more' in shown
    assert 'a\\nb' in shown and '\x1b' not in shown
    assert len(shown) < 1000


def test_deep_and_wide_trees_are_cut():
    buffer = BufferCore()
    for number in range(1500):
        buffer.insert(f'f{number}', f'f{number + 1}', 1, Pose())
        buffer.insert('f0', f'g{number}', 1, Pose())
    shown = buffer._repr_html_()
    assert 'and 2801 more</pre>' in shown
    assert shown.count('\n') == 200


# --- copies and pickles


def copies_of(thing):
    return [pickle.loads(pickle.dumps(thing)), copy.copy(thing), copy.deepcopy(thing)]


def test_snapshot_pickles_and_copies(buffer):
    still = buffer.snapshot()
    still.lookup('map', 'camera')  # so that paths are cached
    still.lookup_tree('map')
    for twin in copies_of(still):
        assert type(twin) is Snapshot
        assert twin.edges() == still.edges()
        assert twin.frames() == still.frames()
        assert twin.lookup('map', 'camera') == still.lookup('map', 'camera')
        assert np.array_equal(twin.lookup_many('map', 'odom', [10 * SECOND, 13 * SECOND]),
                              still.lookup_many('map', 'odom', [10 * SECOND, 13 * SECOND]))
        assert twin.cache_time == still.cache_time
        assert twin.snapshot().edges() == still.edges()


def test_snapshot_of_an_edge_with_two_parents_pickles(buffer):
    buffer.insert('map', 'base', 13 * SECOND, Pose(7.0))
    still = buffer.snapshot()
    for twin in copies_of(still):
        assert twin.lookup('map', 'base', 13 * SECOND) == Pose(7.0)
        assert twin.lookup('odom', 'base', 12 * SECOND) == Pose()


def test_snapshot_pickles_while_another_thread_asks_it(buffer):
    still = buffer.snapshot()
    done = threading.Event()

    def ask():
        while not done.is_set():
            for frame in still.frames()[:5]:
                still.lookup('map', frame)

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        for _ in range(50):
            assert pickle.loads(pickle.dumps(still)).edges() == still.edges()
    finally:
        done.set()
        thread.join()


@pytest.mark.parametrize('carry', [pickle.dumps, copy.copy, copy.deepcopy])
def test_buffer_says_that_its_snapshot_can_be_carried(buffer, carry):
    with pytest.raises(TypeError, match=r'a BufferCore cannot be pickled or copied.*'
                                        r'pickle its snapshot\(\)'):
        carry(buffer)
