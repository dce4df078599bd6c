# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A hold of the lock shows one state, and what was read is believed only if it is intact.

The memory is used again, a hold takes long, or the writer ends meanwhile.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

from known_trees import (
    answer,
    answers,
    CACHE_TIME,
    insert,
    insert_all,
    MS,
    NEWEST,
    pose_of,
    STAMPS,
    STEP,
)
from programs import PATIENCE_S
import pytest
from sharing_trees import error_of
from tf_tree_py import TransformException
from tf_tree_py.core.tree.path import Path
from tf_tree_py.shared import layout, mirror, mirror_tree, sharing
from tf_tree_py.shared.errors import LapsedException, SharedTreeException
from tf_tree_py.shared.layout import BEAT, CHANGED, INTACT, STATE
from tf_tree_py.shared.memory import Memory


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


def test_lookup_is_answered_by_one_state(pair, monkeypatch):
    buffer, tree = pair
    question = 'odom', NEWEST + STEP, 'base', STAMPS[-3] + MS, 'map'
    for child in 'odom', 'base':
        insert(buffer, NEWEST + 2 * STEP, 'map' if child == 'odom' else 'odom', child)
    pose_at, asked, expected = Path.pose_at, [], buffer.lookup_full(*question)

    def changing(path, stamp):
        asked.append(stamp)
        if len(asked) == 1:
            buffer.insert('odom', 'base', STAMPS[-3] + 2 * MS, pose_of(0))
            buffer.insert('map', 'odom', STAMPS[-3] + 2 * MS, pose_of(0))
        return pose_at(path, stamp)

    monkeypatch.setattr(Path, 'pose_at', changing)
    assert tree.lookup_full(*question) == expected
    monkeypatch.undo()
    assert asked == [STAMPS[-3] + MS, NEWEST + STEP]
    assert tree.lookup_full(*question) == buffer.lookup_full(*question) != expected


def test_memory_is_used_again_before_the_next_state_is_there(pair):
    """The writer uses memory again first, so a reader must not wait for the next state."""
    buffer, tree = pair
    words = tree.words
    insert(buffer, NEWEST + MS)
    assert tree.lookup('map', 'base', STAMPS[-3]) == buffer.lookup('map', 'base', STAMPS[-3])
    words[INTACT] = words[STATE] >> 16
    assert tree.frames() == buffer.frames()
    assert tree.lookup('map', 'base', STAMPS[-3]) == buffer.lookup('map', 'base', STAMPS[-3])


def test_what_was_read_in_memory_that_is_used_again_is_not_kept(pair, monkeypatch):
    """Here a reader takes the oldest stamps for newer ones than they are."""
    buffer, tree = pair
    words = tree.words
    with monkeypatch.context() as patch, pytest.raises(LapsedException), tree.mirror:
        patch.setattr(mirror_tree, 'bisect_left', lambda *_: 0)
        words[INTACT] = tree.mirror.state + 1
        tree.lookup('map', 'odom', STAMPS[-3])
    insert_all(buffer, NEWEST + STEP)
    assert tree.lookup('map', 'odom') == buffer.lookup('map', 'odom')
    for _ in range(2):
        insert_all(buffer, NEWEST + 3 * STEP)
    assert answer(tree, 'map', 'odom', STAMPS[1]) == answer(buffer, 'map', 'odom', STAMPS[1])


def test_lookup_in_a_lookup_does_not_ask_again(pair, monkeypatch):
    """Inside of the lock, it would read the same."""
    buffer, tree = pair
    pose_at, asked = Path.pose_at, []

    def counted(path, stamp):
        asked.append(stamp)
        return pose_at(path, stamp)

    monkeypatch.setattr(Path, 'pose_at', counted)
    with pytest.raises(LapsedException), tree.mirror:
        tree.words[INTACT] = tree.mirror.state + 1
        tree.lookup('map', 'base', NEWEST)
    assert asked == [NEWEST]
    insert(buffer, NEWEST + MS)
    assert tree.lookup('map', 'base') == buffer.lookup('map', 'base')


@pytest.mark.parametrize('first_stamp', [STAMPS[-3] + MS, NEWEST + 5 * STEP],
                         ids=['first_half_has_data', 'first_half_has_none'])
def test_lookup_that_was_stopped_for_long_is_asked_again(pair, monkeypatch, first_stamp):
    """Its second half would otherwise be answered by a state that is old, or by another one."""
    buffer, tree = pair
    question = 'odom', NEWEST, 'base', first_stamp, 'map'
    pose_at, asked = Path.pose_at, []

    def slow(path, stamp):
        asked.append(stamp)
        if len(asked) == 1:
            buffer.insert('odom', 'base', STAMPS[-3] + 2 * MS, pose_of(0))
            buffer.insert('map', 'odom', STAMPS[-3] + 2 * MS, pose_of(0))
            monkeypatch.setattr(mirror, 'monotonic_ns', lambda: tree.words[BEAT] + 2 * 10 ** 9)
        else:
            monkeypatch.undo()
        return pose_at(path, stamp)

    def outcome(of):
        try:
            return of.lookup_full(*question)
        except TransformException as error:
            return str(error), error.blocked_on

    monkeypatch.setattr(Path, 'pose_at', slow)
    found = outcome(tree)
    assert found == outcome(buffer)
    assert asked == [first_stamp] * 2


def test_holds_that_were_given_up_all_end(pair, monkeypatch):
    """None of them asks again inside of another, and the lock is free afterwards."""
    buffer, tree = pair
    with pytest.raises(LapsedException) as given_up, tree.mirror, suppress(
            LapsedException), tree.mirror:
        monkeypatch.setattr(mirror, 'monotonic_ns', lambda: tree.words[BEAT] + 2 * 10 ** 9)
        with pytest.raises(LapsedException) as inside:
            tree.lookup('map', 'base')
        assert inside.value.is_inside
        monkeypatch.undo()
    assert not given_up.value.is_inside
    assert 'has held the lock for so long' in str(given_up.value)
    insert_all(buffer, NEWEST + STEP)
    with ThreadPoolExecutor() as pool:
        assert pool.submit(answers, tree).result(PATIENCE_S) == answers(buffer)


def test_interrupted_lookup_does_not_stop_others(pair, monkeypatch):
    """A signal may have left the depth of the lock too large."""
    buffer, tree = pair
    tree.mirror.__enter__()
    insert_all(buffer, NEWEST + STEP)
    insert(buffer, NEWEST - MS)
    monkeypatch.setattr(mirror, 'monotonic_ns', lambda: tree.words[BEAT] + 2 * 10 ** 9)
    with pytest.raises(LapsedException, match='has held the lock for so long'):
        tree.lookup('map', 'base')
    monkeypatch.undo()
    assert answers(tree) == answers(buffer)


@pytest.mark.parametrize('stamp', [0, STAMPS[-3]], ids=['latest', 'known'])
def test_end_of_sharing_during_a_lookup(pair, stamp):
    _, tree = pair
    expected = tree.lookup('map', 'base', stamp)
    with tree.mirror:
        tree.sharing.close()
        assert tree.lookup('map', 'base', stamp) == expected
    assert 'it was stopped, and closed the tree' in error_of(
        lambda: tree.lookup('map', 'base', stamp))


def test_end_of_sharing_while_the_newest_state_is_read(pair, monkeypatch):
    buffer, tree = pair
    words, root_of = tree.words, layout.root_of

    def ended(record):
        monkeypatch.undo()
        tree.sharing.close()
        words[INTACT] = root_of(record).state + 1
        return root_of(record)

    insert(buffer, NEWEST + MS)
    monkeypatch.setattr(layout, 'root_of', ended)
    assert 'it was stopped, and closed the tree' in error_of(lambda: tree.lookup('map', 'base'))


# --- the writer

@pytest.mark.parametrize('place', [
    (layout, 'write_root'), (sharing, 'directory_of'), (layout, 'state_word')],
    ids=['root', 'directory', 'state'])
@pytest.mark.parametrize('change', [
    lambda buffer: buffer.insert('odom', 'base', STAMPS[-3] + MS // 2, pose_of(0)),
    lambda buffer: insert(buffer, NEWEST, 'map', 'new')], ids=['late', 'new'])
def test_interrupted_writer_completes_the_state_later(pair, monkeypatch, change, place):
    buffer, tree = pair

    def interrupted(*_):
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(*place, interrupted)
    with pytest.raises(KeyboardInterrupt):
        change(buffer)
    insert(buffer, NEWEST + MS)
    assert answers(tree) == answers(buffer)
    assert answer(tree, 'map', 'new') == answer(buffer, 'map', 'new')


def test_there_is_no_new_state_after_the_end(pair, monkeypatch):
    """A block is refused in the middle of a state, and nothing else is asked for."""
    buffer, tree = pair
    asked = []

    def refused(_, size):
        asked.append(size)
        raise SharedTreeException('there is no memory left')

    monkeypatch.setattr(Memory, 'allocate', refused)
    insert(buffer, NEWEST + STEP, 'map')  # which also needs another directory
    assert len(asked) == 1
    assert tree.sharing.over.is_set()
    assert tree.words[STATE] == -1
    for stamp in 0, STAMPS[-3] + MS, STAMPS[5]:
        assert 'there is no memory left' in str(answer(tree, 'map', 'base', stamp))
