# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
0 is an ordinary time, except in a lookup of a single pose, where it is LATEST.

All results of a tree whose time begins at 0, or includes it, equal those of the
same tree a day later.
"""

from hypothesis import example, given, strategies as st
import numpy as np
import pytest
from strategies import random_poses
from tf_tree_py import BufferCore, lookup_twist, lookup_twist_many
from tf_tree_py.beyond.motion.scans import deskew
from tf_tree_py.core import (
    ExtrapolationException,
    LATEST,
    PastExtrapolationException,
    Pose,
    TransformException,
)

SECOND = 1_000_000_000
DAY = 86_400 * SECOND
POSES = random_poses(np.random.default_rng(7), 32, reach=3.0).tolist()
QUESTIONS = {
    'at': lambda tree, begin: tree.lookup_at('a', 'c', begin),
    'many': lambda tree, begin: tree.lookup_many('a', 'c', [begin, begin + 3, begin + 25]),
    'latest': lambda tree, begin: tree.lookup('a', 'c'),
    'latest time': lambda tree, begin: tree.latest_common_time('a', 'c') - begin,
    'latest tree': lambda tree, begin: tree.lookup_tree('a').get('c', Pose(99.0)),
    'tree': lambda tree, begin: tree.lookup_tree('a', begin + 20).get('c', Pose(99.0)),
    'twist': lambda tree, begin: lookup_twist(tree, 'c', 'a', begin + 30, 4)[1:],
    'latest twist': lambda tree, begin: lookup_twist(
        tree, 'c', 'a', LATEST, 4, reference_point_frame='p')[1:],
    'twists': lambda tree, begin: lookup_twist_many(tree, 'c', 'a', [begin, begin + 3], 4),
    'deskew': lambda tree, begin: deskew(
        tree, [[1.0, 2.0, 3.0]] * 2, [begin, begin + 30], 'c', 'c', begin + 40, 'a'),
}
# The stamps of single lookups, relative to the beginning.
ASKED = {'twist': 30, 'tree': 20, 'deskew': 40}


def answers(arrivals, begin):
    """Return the result of each lookup in a tree whose time begins at a stamp."""
    buffer = BufferCore()
    begun = [(*edge, stamp) for stamp in range(0, 51, 10) for edge in ('ab', 'bc')]
    # A point that is known for a longer time.
    begun += [('a', 'p', stamp) for stamp in range(0, 81, 10)]
    for number, (parent, child, stamp) in enumerate([*begun, *arrivals]):
        buffer.insert(parent, child, begin + stamp, POSES[number % len(POSES)])
    found = {}
    for name, ask in QUESTIONS.items():
        try:
            found[name] = np.concatenate([np.ravel(part) for part in np.atleast_1d(
                np.array(ask(buffer, begin), dtype=object))]).astype(float)
        except TransformException as error:
            found[name] = type(error)
    return found


edges = st.sampled_from([('a', 'b'), ('b', 'c'), ('b', 'c'), ('d', 'c')])


@given(st.lists(st.tuples(edges, st.integers(-3, 53)), max_size=8), st.integers(-60, 10))
@example([], -50)
def test_what_is_asked_around_zero_is_what_is_asked_a_day_later(arrivals, begin):
    arrivals = [(*edge, stamp) for edge, stamp in arrivals]
    now, later = answers(arrivals, begin), answers(arrivals, begin + DAY)
    assert now.keys() == later.keys()
    for name, expected in later.items():
        if begin + ASKED.get(name, DAY) == 0:
            continue  # 0 is LATEST there
        if isinstance(expected, type):
            assert now[name] is expected, name
        else:
            assert now[name] == pytest.approx(expected, rel=1e-9, abs=1e-9), name


@pytest.fixture
def train():
    """Return x = t at 10 Hz, from 0 on."""
    buffer = BufferCore()
    for tenth in range(50):
        buffer.insert('track', 'train', tenth * SECOND // 10, Pose(x=tenth / 10))
    return buffer


def test_twist_near_the_beginning_of_time_is_that_of_the_motion(train):
    for stamp in (1, SECOND // 50, SECOND):
        twist = lookup_twist(train, 'train', 'track', stamp, SECOND // 10)
        assert twist.linear == pytest.approx((1.0, 0.0, 0.0))


def test_reparented_edge_at_zero_has_the_parent_of_then():
    buffer = BufferCore()
    buffer.insert('shelf', 'box', -5, Pose(1.0))
    buffer.insert('shelf', 'box', 5, Pose(3.0))
    buffer.insert('gripper', 'box', 10, Pose(9.0))
    assert buffer.lookup_at('shelf', 'box', 0) == Pose(2.0)
    assert buffer.lookup_many('shelf', 'box', [0])[0] == pytest.approx(Pose(2.0))


def test_zero_before_the_data_is_the_past():
    buffer = BufferCore()
    buffer.insert('a', 'b', 5, Pose())
    buffer.insert('a', 'b', 9, Pose())
    with pytest.raises(PastExtrapolationException):
        buffer.lookup_at('a', 'b', 0)
    with pytest.raises(PastExtrapolationException):
        buffer.lookup_many('a', 'b', [0])


def test_edge_whose_newest_stamp_is_zero_holds_the_latest_back(train):
    """tf2 ignores this edge, and the lookup fails."""
    train.insert('train', 'door', 0, Pose(y=1.0))
    assert train.latest_common_time('track', 'door') == 0
    assert train.lookup('track', 'door') == Pose(y=1.0)
    with pytest.raises(ExtrapolationException):
        train.lookup('track', 'door', 1)
