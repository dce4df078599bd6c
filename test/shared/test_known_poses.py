# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses that a reader knows already: new samples change none of them, and all else does.

A shared tree does not look at a state with nothing new but samples, if the stamp is between two
samples that it knows. Its answers, and its errors, have to be those of a buffer all the same.
"""

from concurrent.futures import ThreadPoolExecutor
import gc
import itertools
import mmap

import pytest
from sharing_trees import error_of, shared, SharingBuffer
from tf_tree_py import BufferCore, from_seconds, TransformException
from tf_tree_py.core.tree import path_finder
from tf_tree_py.core.tree.climb import Cleared
from tf_tree_py.core.tree.path import Path
from tf_tree_py.shared import layout, mirror_tree
from tf_tree_py.shared.attachment import Attachment
from tf_tree_py.shared.errors import LapsedException
from tf_tree_py.shared.layout import CHANGED, INTACT, PAGE, STATE
from tf_tree_py.shared.memory import Memory
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import attach, SharedTree

CACHE_TIME = from_seconds(1.0)
MS = 10 ** 6
STEP = 10 * MS
# The first is the oldest in the window of the newest.
STAMPS = range(2 * STEP, 2 * STEP + CACHE_TIME + STEP, STEP)
NEWEST = STAMPS[-1]
PAIRS = [('map', 'base'), ('odom', 'map'), ('map', 'arm'), ('base', 'camera'), ('map', 'nothing')]


def pose_of(stamp):
    return stamp / STEP, 1.0, 2.0, 0.0, 0.0, 0.6, 0.8


def insert(buffer, stamp, parent='odom', child='base'):
    buffer.insert(parent, child, stamp, pose_of(stamp), strict=False)


def insert_all(buffer, stamp):
    for parent, child in ('map', 'odom'), ('odom', 'base'), ('map', 'arm'):
        insert(buffer, stamp, parent, child)


def answer(tree, *arguments):
    """Return a pose, or all that the error says."""
    try:
        return tree.lookup(*arguments)
    except TransformException as error:
        return type(error), str(error)


def answers(tree):
    """Look up each pair in turn, everywhere, and then the latest."""
    asked = [STAMPS[0] - STEP + half * STEP // 2 for half in range(2 * len(STAMPS) + 4)]
    return [answer(tree, *pair, stamp) for stamp in [*asked, 0] for pair in PAIRS]


@pytest.fixture
def pair(monkeypatch):
    """Return a buffer, and a tree that shows it, knows all poses, and can change the header."""
    monkeypatch.setattr(Memory, 'keep_s', 0.0)  # memory is used again at once
    buffer = SharingBuffer(CACHE_TIME, now=lambda: 0)
    for stamp in STAMPS:
        insert_all(buffer, stamp)
    buffer.insert('base', 'camera', 0, pose_of(3 * STEP), static=True)
    with shared(buffer) as (domain_id, sharing):
        place, tree = Place(domain_id), BufferCore(CACHE_TIME, now=lambda: 0)
        tree.mirror = attach(tree, Attachment(place))
        with place.memory.open('r+b') as file:
            tree.words = memoryview(mmap.mmap(file.fileno(), PAGE)).cast('q')
        tree.sharing = sharing
        assert answers(tree) == answers(buffer)
        yield buffer, tree


@pytest.fixture
def looks(monkeypatch):
    """Return how often the root of a state was read."""
    states = []
    root_of = layout.root_of

    def counted(memory, state):
        states.append(state)
        return root_of(memory, state)

    monkeypatch.setattr(layout, 'root_of', counted)
    return states


def fill(buffer):
    for number in range(1, 300):
        insert(buffer, NEWEST + number * MS)


def all_newer(buffer):
    insert_all(buffer, NEWEST + STEP)


CHANGES = {
    'newer': lambda buffer: insert(buffer, NEWEST + STEP),
    'equal': lambda buffer: buffer.insert(
        'odom', 'base', NEWEST, pose_of(len(buffer.stamps_of('base')))),
    'late': lambda buffer: insert(buffer, NEWEST - STEP // 2),
    'late_and_equal': lambda buffer: buffer.insert('odom', 'base', NEWEST - STEP, pose_of(0)),
    'another_edge_is_late': lambda buffer: insert(buffer, NEWEST - STEP // 2, 'map', 'arm'),
    'some_expired': lambda buffer: [insert(buffer, NEWEST + 3 * STEP) for _ in range(2)],
    'half_expired': lambda buffer: [
        insert(buffer, NEWEST + CACHE_TIME // 2 + MS) for _ in range(2)],
    'all_expired': lambda buffer: [insert(buffer, NEWEST + 9 * CACHE_TIME) for _ in range(2)],
    'blocks_moved': fill,
    'memory_used_again': lambda buffer: [
        insert(buffer, NEWEST - number * MS, 'map', 'arm') for number in range(2, 400)],
    'cleared': lambda buffer: buffer.clear(),
    'cleared_and_filled': lambda buffer: [buffer.clear(), *[
        insert(buffer, stamp + MS) for stamp in STAMPS]],
    'removed': lambda buffer: buffer.remove_frame('base'),
    'other_parent': lambda buffer: insert(buffer, NEWEST + STEP, 'map'),
    'other_parent_before': lambda buffer: insert(buffer, STAMPS[5] + MS, 'map'),
    'other_static_pose': lambda buffer: buffer.insert(
        'base', 'camera', 0, pose_of(0), static=True),
    'now_static': lambda buffer: buffer.insert(
        'odom', 'base', 0, pose_of(0), static=True, strict=False),
}


@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_answers_are_those_of_a_buffer_after_a_change(pair, change):
    buffer, tree = pair
    change(buffer)
    assert answers(tree) == answers(buffer)


@pytest.mark.parametrize('first', PAIRS[:4])
@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_each_question_may_be_the_first_after_a_change(pair, change, first):
    buffer, tree = pair
    for stamp in (0, NEWEST - STEP // 2, NEWEST, STAMPS[0], STAMPS[50] + MS):
        change(buffer)
        assert answer(tree, *first, stamp) == answer(buffer, *first, stamp)
        assert tree.lookup_tree('map', NEWEST) == buffer.lookup_tree('map', NEWEST)
        change(buffer)
        assert tree.edges() == buffer.edges()


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


@pytest.mark.parametrize('looks_at_others', [True, False], ids=['other_pair', 'alone'])
def test_memory_of_a_known_pose_is_used_again(pair, looks_at_others):
    """A pair that is looked up rarely lies on older memory than another one."""
    buffer, tree = pair
    words, newest, found = tree.words, NEWEST, 0
    for _ in range(40):
        assert tree.lookup('map', 'base', STAMPS[-3]) == buffer.lookup('map', 'base', STAMPS[-3])
        known, changed = tree.mirror.state, words[CHANGED]
        while words[INTACT] <= known and newest < NEWEST + CACHE_TIME // 2:
            newest += MS
            for parent, child in ('odom', 'base'), ('map', 'arm'):
                insert(buffer, newest, parent, child)
            if looks_at_others:
                assert tree.lookup('map', 'arm') == buffer.lookup('map', 'arm')
        found += words[INTACT] > known and words[CHANGED] == changed
    assert answers(tree) == answers(buffer)
    assert found


def test_memory_that_is_used_again_during_a_lookup_is_not_believed(pair, monkeypatch):
    """It belongs to the state that the pair lies on, which is older than the one seen last."""
    buffer, tree = pair
    stamp = STAMPS[-3] + 1
    expected = tree.lookup('map', 'base', stamp)
    known = tree.mirror.state
    for number in range(1, 10):
        insert(buffer, NEWEST + number * MS)
    tree.lookup('map', 'arm')
    assert tree.mirror.state > known + 1
    pose_at, words, asked = Path.pose_at, tree.words, []

    def slow(path, stamp):
        asked.append(stamp)
        words[INTACT] = known + 1  # as the writer does before it uses memory again
        return pose_at(path, stamp)

    monkeypatch.setattr(Path, 'pose_at', slow)
    assert tree.lookup('map', 'base', stamp) == expected
    assert asked == [stamp, stamp]


def test_change_in_the_middle_of_a_lookup_is_asked_again(pair, monkeypatch):
    """Both halves are answered by one state, although the first needs no look."""
    buffer, tree = pair
    question = 'odom', NEWEST + STEP, 'base', STAMPS[-3] + MS, 'map'
    for child in 'odom', 'base':
        insert(buffer, NEWEST + 2 * STEP, 'map' if child == 'odom' else 'odom', child)
    pose_at, asked = Path.pose_at, []

    def changing(path, stamp):
        asked.append(stamp)
        if len(asked) == 1:
            buffer.insert('odom', 'base', STAMPS[-3] + 2 * MS, pose_of(0))
            buffer.insert('map', 'odom', STAMPS[-3] + 2 * MS, pose_of(0))
        return pose_at(path, stamp)

    monkeypatch.setattr(Path, 'pose_at', changing)
    found = tree.lookup_full(*question)
    monkeypatch.undo()
    assert found == buffer.lookup_full(*question)
    assert asked == [STAMPS[-3] + MS, STAMPS[-3] + MS, NEWEST + STEP]


def test_memory_is_used_again_before_the_next_state_is_there(pair):
    """The writer uses memory again first, so a reader must not wait for the next state."""
    buffer, tree = pair
    words = tree.words
    insert(buffer, NEWEST + MS)
    assert tree.lookup('map', 'base', STAMPS[-3]) == buffer.lookup('map', 'base', STAMPS[-3])
    words[INTACT] = words[STATE] >> 16
    assert tree.frames() == buffer.frames()
    assert tree.lookup('map', 'base', STAMPS[-3]) == buffer.lookup('map', 'base', STAMPS[-3])


def test_what_was_read_in_memory_that_is_used_again_is_not_kept(pair, looks):
    buffer, tree = pair
    words = tree.words
    with pytest.raises(LapsedException), tree.mirror:
        words[INTACT] = tree.mirror.state + 1
        tree.lookup('map', 'odom', STAMPS[-3])
    for number in (1, 2):
        insert_all(buffer, NEWEST + number * MS)
        looks.clear()
        assert tree.lookup('map', 'odom', STAMPS[-3]) == buffer.lookup('map', 'odom', STAMPS[-3])
        assert looks


def test_lookup_in_a_lookup_does_not_ask_again(pair, looks):
    """Inside of the lock, it would read the same."""
    buffer, tree = pair
    insert(buffer, NEWEST + MS)
    with pytest.raises(LapsedException, match='has changed during this lookup'), tree.mirror:
        insert(buffer, NEWEST)
        looks.clear()
        tree.lookup('map', 'base')
    assert len(looks) == 1
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')


def test_interrupted_lookup_does_not_stop_others(pair):
    """A signal may have left the depth of the lock too large."""
    buffer, tree = pair
    insert(buffer, NEWEST + MS)
    tree.mirror.__enter__()
    insert(buffer, NEWEST)
    with pytest.raises(LapsedException):
        tree.lookup('map', 'base')
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')


def test_end_of_sharing_during_a_lookup(pair):
    buffer, tree = pair
    insert(buffer, NEWEST + MS)
    with pytest.raises(LapsedException, match='has changed during this lookup'), tree.mirror:
        tree.sharing.close()
        tree.lookup('map', 'base')
    assert 'it was stopped, and closed the tree' in error_of(lambda: tree.lookup('map', 'base'))


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
