# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A buffer that is shared, and a tree that knows all its poses; and what may change them."""

from contextlib import contextmanager
import mmap

from sharing_trees import shared, SharingBuffer
from tf_tree_py import BufferCore, from_seconds, TransformException
from tf_tree_py.shared.attachment import Attachment
from tf_tree_py.shared.layout import PAGE
from tf_tree_py.shared.memory import Memory
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import attach

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


@contextmanager
def pair_of_trees(monkeypatch):
    """Yield a buffer, and a tree that shows it, knows all poses, and can change the header."""
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


def fill(buffer):
    for number in range(1, 300):
        insert(buffer, NEWEST + number * MS)


def all_newer(buffer):
    insert_all(buffer, NEWEST + STEP)


CHANGES = {
    'newer': lambda buffer: insert(buffer, NEWEST + STEP),
    'equal': lambda buffer: buffer.insert(
        'odom', 'base', NEWEST, pose_of(len(buffer.stamps_of('base')))),
    'late': lambda buffer: buffer.insert('odom', 'base', NEWEST - STEP // 2, pose_of(0)),
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
