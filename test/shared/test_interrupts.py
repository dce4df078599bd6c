# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A keyboard interrupt at each call of the writer, or of a reader; then both go on.

The change may be made or not, as in any buffer; but a reader has what the writer has. In the
middle of a history, an interrupt may leave half a sample, as in any buffer; so changes that end
there are interrupted in the reader only.
"""

from contextlib import contextmanager, suppress
import itertools

from interrupts import Interrupt
from known_trees import answer, insert, MS, pose_of
import pytest
from sharing_trees import shared, SharingBuffer
from tf_tree_py import SharedTree
from tf_tree_py.shared.memory import Memory

FOLDER = '/tf_tree_py/shared/'
STAMPS = range(10 * MS, 50 * MS, MS)
NEWEST = STAMPS[-1]
IN_HISTORIES = {
    'late': lambda buffer: buffer.insert('odom', 'base', NEWEST - MS // 2, pose_of(0)),
    'late_and_equal': lambda buffer: buffer.insert('odom', 'base', NEWEST - MS, pose_of(0)),
    'other_parent': lambda buffer: insert(buffer, NEWEST + MS, 'map'),
    'cleared': lambda buffer: buffer.clear(),
    'cleared_and_filled': lambda buffer: [buffer.clear(), insert(buffer, NEWEST)],
}
CHANGES = {
    'newer': lambda buffer: insert(buffer, NEWEST + MS),
    'expired': lambda buffer: [insert(buffer, NEWEST + 80 * MS) for _ in range(2)],
    'new': lambda buffer: insert(buffer, NEWEST, 'map', 'new'),
    'many_new': lambda buffer: [insert(buffer, NEWEST, 'map', f'new_{n}') for n in range(5)],
    'now_static': lambda buffer: buffer.insert(
        'odom', 'base', 0, pose_of(0), static=True, strict=False),
    'removed': lambda buffer: buffer.remove_frame('base'),
    'block_is_full': lambda buffer: [
        insert(buffer, NEWEST + number * MS) for number in range(1, 60)],
}


@contextmanager
def small_trees():
    buffer = SharingBuffer(100 * MS, now=lambda: 0)
    for stamp in STAMPS:
        insert(buffer, stamp, 'map', 'odom')
        insert(buffer, stamp)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        yield buffer, tree


def answers(tree):
    return [answer(tree, 'map', frame, stamp) for frame in ('odom', 'base', 'new')
            for stamp in (0, STAMPS[0], STAMPS[7] + 1, NEWEST - MS, NEWEST - MS // 2,
                          NEWEST - MS // 4, NEWEST, NEWEST + MS // 2, NEWEST + MS,
                          NEWEST + 79 * MS)]


@pytest.fixture(autouse=True)
def memory_is_used_again_at_once(monkeypatch):
    monkeypatch.setattr(Memory, 'keep_s', 0.0)


@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_reader_has_what_the_writer_has_after_an_interrupt(change):
    for number in itertools.count():
        with small_trees() as (buffer, tree):
            answers(tree)
            with Interrupt(number, FOLDER) as interrupt:
                change(buffer)
            if interrupt.left >= 0:
                break
            for after in range(81, 122):  # each edge gets another block
                insert(buffer, NEWEST + after * MS, 'map', 'odom')
                insert(buffer, NEWEST + after * MS)
                if after in (81, 121):
                    assert answers(tree) == answers(buffer), number
    assert number > 10


@pytest.mark.parametrize('change', (CHANGES | IN_HISTORIES).values(), ids=CHANGES | IN_HISTORIES)
def test_reader_that_was_interrupted_asks_again(change):
    for number in itertools.count():
        with small_trees() as (buffer, tree):
            tree.lookup('map', 'base')
            change(buffer)
            with Interrupt(number, FOLDER) as interrupt, suppress(Exception):
                answers(tree)
            if interrupt.left >= 0:
                break
            assert answers(tree) == answers(buffer), number
    assert number > 10
