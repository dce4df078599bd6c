# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Known poses are returned without the lock, while other threads change the tree.

All answers have to be those of a buffer; see ``test_known_poses``.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
import itertools
import sys

from known_trees import answer, answers, CHANGES, insert_all, MS, NEWEST, pose_of, STAMPS, STEP
import pytest
from sharing_trees import shared, SharingBuffer
from tf_tree_py import SharedTree
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.tree.path import Path
from tf_tree_py.shared.mirror import Mirror

CHANGES_MEANWHILE = {name: CHANGES[name] for name in (
    'late', 'blocks_moved', 'memory_used_again', 'cleared', 'removed', 'other_parent_before')}


@pytest.mark.parametrize('stamp', [0, STAMPS[-3] + 1], ids=['latest', 'known'])
@pytest.mark.parametrize('change', CHANGES_MEANWHILE.values(), ids=CHANGES_MEANWHILE)
def test_another_thread_changes_the_tree_meanwhile(pair, monkeypatch, change, stamp):
    """The lookup is asked again with the lock, because the edges may have changed under it."""
    buffer, tree = pair
    tree.lookup('map', 'base', stamp)
    pose_at, asked = Path.pose_at, []

    def changing(path, at):
        asked.append(at)
        if len(asked) == 1:
            change(buffer)
            assert pool.submit(tree.frames).result()
            pool.submit(answers, tree).result()
        return pose_at(path, at)

    with ThreadPoolExecutor() as pool:
        monkeypatch.setattr(Path, 'pose_at', changing)
        found = answer(tree, 'map', 'base', stamp)
    monkeypatch.undo()
    assert found == answer(buffer, 'map', 'base', stamp)


@pytest.mark.parametrize('stamp', [0, STAMPS[-3] + 1], ids=['latest', 'known'])
def test_pose_is_not_known_while_another_thread_holds_the_lock(pair, stamp):
    """That thread may be in the middle of a change."""
    _, tree = pair
    question = 'map', 'base', stamp
    expected = tree.lookup_stamped(*question)
    with ThreadPoolExecutor() as pool:
        with tree.mirror:
            assert pool.submit(tree.mirror.known, *question).result() is None
            assert tree.mirror.known(*question) is None
        assert pool.submit(tree.mirror.known, *question).result() == expected


def test_observer_sees_lookups_of_known_poses(pair):
    _, tree = pair
    seen = []

    class Watching(Observer):

        def asked(self, *question):
            seen.append(question)

    watching = Watching()
    tree.lookup('map', 'base', STAMPS[-3])
    tree.observers.add(watching)
    tree.lookup('map', 'base', STAMPS[-3])
    assert seen == [('map', 'base', STAMPS[-3])]


@pytest.mark.parametrize('question', [
    ('map', 'base', 1.5), ('map', 'base', None), ('map', 'base', -1), ('map', 'base', 10**30),
    (['map'], 'base', NEWEST), ('map', 7, NEWEST), ('map', 'map', NEWEST),
    ('nothing', 'nothing', 0),
], ids=repr)
def test_what_is_not_known_is_answered_as_in_a_buffer(pair, question):
    buffer, tree = pair
    try:
        expected = buffer.lookup(*question)
    except Exception as error:
        with pytest.raises(type(error)) as found:
            tree.lookup(*question)
        assert str(found.value) == str(error)
    else:
        assert tree.lookup(*question) == expected


def test_latest_stamp_of_a_frame_in_itself_is_that_of_its_edge(pair):
    buffer, tree = pair
    for stamp in NEWEST + STEP, NEWEST + 2 * STEP:
        insert_all(buffer, stamp)
        for frame in 'map', 'base', 'camera':
            for asked in 0, NEWEST - MS, NEWEST - MS:
                assert tree.lookup_stamped(frame, frame, asked) == buffer.lookup_stamped(
                    frame, frame, asked)


def test_lookups_of_a_program_are_its_own():
    class Shifted(SharedTree):

        def lookup_stamped(self, *question):
            stamp, pose = super().lookup_stamped(*question)
            return stamp, (pose[0] + 1000.0, *pose[1:])

    buffer = SharingBuffer()
    for stamp in STAMPS:
        insert_all(buffer, stamp)
    with shared(buffer) as (domain_id, _), Shifted(domain_id=domain_id) as tree:
        for stamp in [STAMPS[9] + MS] * 3 + [0] * 3:
            assert tree.lookup('map', 'base', stamp).x == buffer.lookup(
                'map', 'base', stamp).x + 1000.0


class Between:
    """Calls a function before a line of ``Mirror.known``, in this thread."""

    def __init__(self, line, call):
        self.left, self.call = line, call

    def __enter__(self):
        self.before = sys.gettrace()
        sys.settrace(self.trace)
        return self

    def __exit__(self, *_):
        sys.settrace(self.before)

    def trace(self, frame, event, _):
        return self.trace_line if frame.f_code is Mirror.known.__code__ else None

    def trace_line(self, _, event, __):
        if event == 'line':
            self.left -= 1
            if self.left == -1:
                self.call()
        return self.trace_line


@pytest.mark.parametrize('is_published_before', [True, False], ids=['before', 'meanwhile'])
@pytest.mark.parametrize('stamp', [0, NEWEST - STEP // 4], ids=['latest', 'known'])
def test_another_thread_runs_between_any_two_lines(pair, stamp, is_published_before):
    buffer, tree = pair

    def publish(line):
        for late in NEWEST - STEP // 2, NEWEST:
            buffer.insert('odom', 'base', late, pose_of(line))

    def meanwhile(line):
        if not is_published_before:
            publish(line)
        pool.submit(tree.lookup, 'map', 'arm').result()
        pool.submit(tree.lookup, 'odom', 'base', stamp).result()

    with ThreadPoolExecutor() as pool:
        for line in itertools.count():
            before = tree.lookup('map', 'base', stamp)
            assert before == tree.lookup('map', 'base', stamp)

            if is_published_before:
                publish(line)
            with Between(line, partial(meanwhile, line)) as between:
                found = tree.lookup('map', 'base', stamp)
            after = buffer.lookup('map', 'base', stamp)
            assert found == after or not is_published_before and found == before
            if between.left >= 0:
                break
    assert line > (5 if is_published_before else 10)
