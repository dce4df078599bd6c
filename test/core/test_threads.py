# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Concurrent writers and readers: every result is one of a consistent tree."""

import time

from crew import Crew, PATIENCE_S
from hypothesis import settings
import numpy as np
from strategies import assert_same_pose
from tf_tree_py import BufferCore
from tf_tree_py.core import LATEST, LookupException, Pose, Sample, TransformException
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.sample import Batch

TICK = 1000
# More than the window of the readers, which is 200.
TICKS = 3000 if settings().max_examples >= 20 else 1000


def pose_at(stamp):
    """Return a pose whose seven numbers all depend on its stamp, also between two ticks."""
    ticks = stamp / TICK
    return Pose.from_xyz_rpy(ticks, -2.0 * ticks, 0.5, yaw=1e-3 * ticks)


def assert_tells_its_stamp(pose, stamp, edges):
    """Assert that each of the numbers of a chain's pose matches its stamp."""
    expected = Pose()
    for _ in range(edges):
        expected @= pose_at(stamp)
    assert_same_pose(pose, expected, 1e-9, reach=TICKS)


def test_no_reader_sees_a_torn_pose():
    buffer = BufferCore(200 * TICK)  # short, so that expired blocks are dropped during the test
    crew = Crew()
    edges = (('a', 'b'), ('b', 'c'))

    def write_messages():
        for tick in range(1, TICKS):
            stamp = TICK * tick
            poses = [pack_pose(*pose_at(stamp))] * 2
            if tick % 2:
                buffer.insert_batch(Batch(edges, [stamp, stamp], poses))
            else:
                buffer.insert_many([Sample(*edge, stamp, pose_at(stamp)) for edge in edges])

    def write_a_side_branch(child):
        for tick in range(1, TICKS):
            buffer.insert('a', child, TICK * tick, pose_at(TICK * tick))

    def write_late():
        for tick in range(1, TICKS):
            newest = buffer.latest_common_time('a', 'b')
            stamp = newest - (tick * 37) % (150 * TICK)
            if stamp > 0:
                buffer.insert('a', 'b', stamp, pose_at(stamp))

    def change_the_structure():
        for tick in range(TICKS):
            parent = 'ab'[tick % 2]
            buffer.insert(parent, 'tool', 0, Pose(1.0), static=True, authority='tool')

    def read_latest():
        stamp, pose = buffer.lookup_stamped('a', 'c')
        assert_tells_its_stamp(pose, stamp, 2)
        stamp, pose = buffer.lookup_stamped('a', 'd')
        assert_tells_its_stamp(pose, stamp, 1)

    def read_the_past():
        stamp = buffer.latest_common_time('a', 'c')
        for back in (0, 1, 333, TICK, 50 * TICK + 7, 150 * TICK):
            try:
                pose = buffer.lookup('a', 'c', max(stamp - back, 1))
            except TransformException:
                continue  # before the beginning, or already out of the window
            assert_tells_its_stamp(pose, max(stamp - back, 1), 2)

    def read_what_changes():
        stamp, pose = buffer.lookup_stamped('b', 'tool')
        # Below b, it is always one metre ahead; below a, the position of b at the stamp matters.
        expected = Pose(1.0) if stamp == LATEST else pose_at(stamp).inverse() @ Pose(1.0)
        assert_same_pose(pose, expected, 1e-9, reach=TICKS)
        children = [edge.child for edge in buffer.edges()]
        assert sorted(children) == ['b', 'c', 'd', 'e', 'tool']

    def read_many():
        newest = buffer.latest_common_time('a', 'c')
        stamps = [max(newest - back, 1) for back in range(0, 250 * TICK, 7777)]
        poses, valid = buffer.lookup_many('a', 'c', stamps, outside='mask')
        # The number left depends on the progress of the writers.
        for stamp, pose in zip(np.array(stamps)[valid].tolist(), poses[valid], strict=True):
            assert_tells_its_stamp(pose.tolist(), stamp, 2)

    def read_a_snapshot():
        still = buffer.snapshot()
        stamp, pose = still.lookup_stamped('a', 'c')
        assert_tells_its_stamp(pose, stamp, 2)
        # The buffer has changed since; the snapshot has not.
        assert still.lookup_stamped('a', 'c') == (stamp, pose)

    for edge in (*edges, ('a', 'd'), ('a', 'e')):
        buffer.insert(*edge, TICK, pose_at(TICK))
    buffer.insert('a', 'tool', 0, Pose(1.0), static=True)
    for function in (write_messages, write_late, change_the_structure):
        crew.write(function)
    for child in 'de':
        crew.write(write_a_side_branch, child)
    for function in (read_latest, read_the_past, read_what_changes, read_many, read_a_snapshot):
        crew.read(function)
    crew.run()
    assert buffer.statistics().accepted > 3 * TICKS


def test_waiting_lookups_all_get_their_own_stamp():
    buffer = BufferCore()
    buffer.insert('a', 'b', TICK, pose_at(TICK))
    crew = Crew()
    ticks = range(2, 400)

    def write():
        for tick in ticks:
            buffer.insert('a', 'b', TICK * tick, pose_at(TICK * tick))

    def ask(first):
        for tick in ticks[first::8]:
            begin = time.monotonic()
            pose = buffer.lookup_within(PATIENCE_S / 2, 'a', 'b', TICK * tick)
            assert_tells_its_stamp(pose, TICK * tick, 1)
            # The wait looks up once more at its end, which must not hide a missing wake-up.
            assert time.monotonic() - begin < PATIENCE_S / 2

    crew.write(write)
    for first in range(8):
        crew.write(ask, first)
    crew.run()
    assert len(buffer.waiting) == 0


def test_no_answer_outlives_a_clear():
    """Clearing, removing and filling while others read gives a result, or an error of tf2."""
    buffer = BufferCore()
    crew = Crew()

    def fill():
        for tick in range(1, TICKS):
            buffer.insert('a', 'b', TICK * tick, pose_at(TICK * tick))
            buffer.insert('b', 'c', TICK * tick, pose_at(TICK * tick))

    def forget():
        for tick in range(300):
            buffer.clear()
            if tick % 10 == 0:
                buffer.remove_frame('c')
                buffer.waiting.fail(LookupException('forgotten'))

    def read():
        try:
            stamp, pose = buffer.lookup_stamped('a', 'c')
        except TransformException as error:
            assert str(error)
        else:
            assert_tells_its_stamp(pose, stamp, 2)

    def wait():
        try:
            buffer.lookup_within(0.001, 'a', 'c', TICK * TICKS)
        except TransformException as error:
            assert error.waited_s is not None

    crew.write(fill)
    crew.write(forget)
    crew.read(read)
    crew.read(wait)
    crew.run()
    assert len(buffer.waiting) == 0
