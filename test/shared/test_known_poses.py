# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses that a reader knows already: new samples change none of them, and all else does.

A lookup in a shared tree does not look at a state with nothing new but samples, and does not even
acquire the lock, if the stamp is between two samples that it knows. Its answers, and its errors,
have to be those of a buffer all the same.
"""

from concurrent.futures import ThreadPoolExecutor
import gc
import itertools
import time

from known_trees import (
    all_newer,
    answer,
    answers,
    CACHE_TIME,
    CHANGES,
    insert,
    insert_all,
    MS,
    NEWEST,
    PAIRS,
    pose_of,
    STAMPS,
    STEP,
)
from programs import PATIENCE_S
import pytest
from sharing_trees import shared, SharingBuffer
from tf_tree_py import from_seconds
from tf_tree_py.core.tree import path_finder
from tf_tree_py.core.tree.climb import Cleared
from tf_tree_py.shared import layout, mirror_tree
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.layout import BEAT, STATE
from tf_tree_py.shared.shared_tree import SharedTree


@pytest.fixture
def looks(monkeypatch):
    """Return the number of each state at which a reader looks."""
    states = []
    root_of = layout.root_of

    def counted(record):
        root = root_of(record)
        states.append(root.state)
        return root

    monkeypatch.setattr(layout, 'root_of', counted)
    return states


@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_answers_are_those_of_a_buffer_after_a_change(pair, change):
    buffer, tree = pair
    change(buffer)
    assert answers(tree) == answers(buffer)


@pytest.mark.parametrize('stamp', [0, STAMPS[0], STAMPS[50] + MS, NEWEST - STEP // 2],
                         ids=['latest', 'oldest', 'middle', 'late'])
@pytest.mark.parametrize('first', PAIRS[:4])
@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_each_question_may_be_the_first_after_a_change(pair, change, first, stamp):
    buffer, tree = pair
    change(buffer)
    assert answer(tree, *first, stamp) == answer(buffer, *first, stamp)
    assert tree.lookup_tree('map', NEWEST) == buffer.lookup_tree('map', NEWEST)
    change(buffer)
    assert tree.edges() == buffer.edges()


def test_latest_pose_of_a_pair_is_that_of_the_newest_state(pair):
    """Another question has looked at that state before."""
    buffer, tree = pair
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')
    insert_all(buffer, NEWEST + STEP)
    assert tree.frames() == buffer.frames()
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')


def test_known_pose_is_not_returned_when_the_writer_has_ended(pair):
    _, tree = pair
    with tree.sharing.lock:  # so that it gives no sign of life
        tree.words[BEAT] = 0
        end = time.monotonic() + PATIENCE_S
        error = None
        while error is None and time.monotonic() < end:
            try:
                tree.lookup('map', 'base', STAMPS[-3])
            except SharedTreeException as found:
                error = found
    assert 'its last sign of life was' in str(error)


QUESTIONS = {
    'tree': lambda tree: tree.lookup_tree('map'),
    'many': lambda tree: tree.lookup_many(
        'map', 'base', list(STAMPS), outside='mask')[0].tobytes(),
    'edges': lambda tree: tree.edges(),
    'stamps': lambda tree: tree.stamps_of('base').tolist(),
    'common': lambda tree: tree.latest_common_time('odom', 'base'),
    'snapshot': lambda tree: tree.snapshot().edges(),
    'around': lambda tree: tree.samples_around('base', NEWEST + MS),
    'links': lambda tree: tree.edges_between('odom', 'base', NEWEST),
}


@pytest.mark.parametrize('ask', QUESTIONS.values(), ids=QUESTIONS)
@pytest.mark.parametrize('change', [all_newer, CHANGES['late']], ids=['newer', 'late'])
def test_other_questions_are_answered_by_the_newest_state(pair, change, ask):
    buffer, tree = pair
    ask(tree)
    change(buffer)
    assert ask(tree) == ask(buffer)


def is_free(lock):
    """Return whether another thread than those that wait for this one could acquire a lock."""
    acquired = lock.acquire(blocking=False)
    if acquired:
        lock.release()
    return acquired


def test_cleared_tree_is_explained_with_the_lock(pair, monkeypatch):
    buffer, tree = pair
    explain, free = Cleared.explain, []

    def explained(*arguments):
        free.append(pool.submit(is_free, tree.mirror.plain).result())
        explain(*arguments)

    buffer.clear()
    monkeypatch.setattr(Cleared, 'explain', explained)
    with ThreadPoolExecutor() as pool:
        assert 'forgot' in str(answer(tree, 'map', 'base', NEWEST))
    assert free == [False]


def test_known_pose_needs_no_look_at_the_newest_state(pair, looks):
    buffer, tree = pair
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')
    looks.clear()
    for number in range(1, 50):
        insert(buffer, NEWEST + number * MS)
        stamp = NEWEST - number * MS // 2
        assert tree.lookup('map', 'base', stamp) == buffer.lookup('map', 'base', stamp)
    assert not looks
    assert tree.lookup('odom', 'base', NEWEST + MS) == buffer.lookup('odom', 'base', NEWEST + MS)
    assert len(looks) == 1


def test_sample_before_a_known_pose_may_expire(pair):
    """The window is renewed in parts; within a part, the oldest poses are not known."""
    buffer, tree = pair
    for number in range(1, 150):
        for parent, child in ('map', 'odom'), ('odom', 'base'):
            insert(buffer, NEWEST + number * STEP, parent, child)
        oldest = NEWEST - CACHE_TIME + number * STEP
        # The oldest last: its error needs a look.
        for stamp in range(oldest + 4 * STEP, oldest - 3 * STEP, -STEP // 2):
            assert answer(tree, 'map', 'base', stamp) == answer(buffer, 'map', 'base', stamp)


def test_window_that_ends_at_zero_is_renewed():
    buffer = SharingBuffer(from_seconds(10.0), now=lambda: 0)
    stamps = [from_seconds(second) for second in range(-30, -19)]
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        for stamp in stamps:
            insert(buffer, stamp)
        asked = 'odom', 'base', stamps[-3] - MS
        assert answer(tree, *asked) == answer(buffer, *asked)
        for _ in range(2):
            insert(buffer, 0)
        assert answer(tree, *asked) == answer(buffer, *asked)


def test_hold_of_the_lock_without_a_change_is_no_new_state(pair):
    """Each new state wakes all that wait, and makes all readers look."""
    buffer, tree = pair
    insert(buffer, NEWEST + MS)
    state = tree.words[STATE]
    assert buffer.lookup('map', 'base') == tree.lookup('map', 'base')
    assert not buffer.insert('base', 'camera', 0, pose_of(3 * STEP), static=True)
    assert tree.words[STATE] == state
    insert(buffer, NEWEST + MS)
    assert tree.words[STATE] != state


def routes():
    """Return what all trees of this process know of paths."""
    gc.collect()
    return [each for each in gc.get_objects() if type(each).__name__ == '_Route']


def test_paths_of_a_tree_that_does_not_change_are_limited(monkeypatch):
    others = routes()
    for module in mirror_tree, path_finder:
        monkeypatch.setattr(module, 'MAX_PATHS', 100)
    buffer = SharingBuffer()
    children = [f'f{number}' for number in range(20)]
    for child in children:
        buffer.insert('map', child, 0, pose_of(0), static=True)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        for target, source in itertools.product(children, children):
            assert tree.lookup(target, source) == buffer.lookup(target, source)
        assert 0 < len(routes()) - len(others) <= 100
