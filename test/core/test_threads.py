# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Many write and read at once: every answer is one that could have been given."""

import time

from crew import Crew, PATIENCE_S
import numpy as np
from strategies import assert_same_pose
from tf_tree_py.core import (
    BufferCore,
    LATEST,
    LookupException,
    Pose,
    Sample,
    TransformException,
)
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.edges.packed import pack_pose

TICK = 1000
TICKS = 3000


def pose_at(stamp):
    """Return a pose whose seven numbers all tell its stamp, also between two ticks."""
    ticks = stamp / TICK
    return Pose.from_xyz_rpy(ticks, -2.0 * ticks, 0.5, yaw=1e-3 * ticks)


def assert_tells_its_stamp(pose, stamp, edges):
    """Hold a chain of so many edges to what its stamp says."""
    expected = Pose()
    for _ in range(edges):
        expected @= pose_at(stamp)
    assert_same_pose(pose, expected, 1e-9, reach=TICKS)


def test_no_reader_sees_a_torn_pose():
    buffer = BufferCore(200 * TICK)  # short, so that expired blocks are dropped meanwhile
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
                continue  # before the beginning, or out of the window by now
            assert_tells_its_stamp(pose, max(stamp - back, 1), 2)

    def read_what_changes():
        stamp, pose = buffer.lookup_stamped('b', 'tool')
        # On b it is one metre ahead for ever; on a, where b was at the stamp matters.
        expected = Pose(1.0) if stamp == LATEST else pose_at(stamp).inverse() @ Pose(1.0)
        assert_same_pose(pose, expected, 1e-9, reach=TICKS)
        children = [edge.child for edge in buffer.edges()]
        assert sorted(children) == ['b', 'c', 'd', 'e', 'tool']

    def read_many():
        newest = buffer.latest_common_time('a', 'c')
        stamps = [max(newest - back, 1) for back in range(0, 250 * TICK, 7777)]
        poses, valid = buffer.lookup_many('a', 'c', stamps, outside='mask')
        # How many are left depends on how far the writers have come meanwhile.
        for stamp, pose in zip(np.array(stamps)[valid].tolist(), poses[valid], strict=True):
            assert_tells_its_stamp(pose.tolist(), stamp, 2)

    def read_a_snapshot():
        frozen = buffer.snapshot()
        stamp, pose = frozen.lookup_stamped('a', 'c')
        assert_tells_its_stamp(pose, stamp, 2)
        # The buffer has gone on by now; what was taken has not.
        assert frozen.lookup_stamped('a', 'c') == (stamp, pose)

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
            # At the end of a wait it tries once more, which must not hide that nobody woke it.
            assert time.monotonic() - begin < PATIENCE_S / 2

    crew.write(write)
    for first in range(8):
        crew.write(ask, first)
    crew.run()
    assert len(buffer.waiting) == 0


def test_no_answer_outlives_a_clear():
    """Clearing, removing and filling again beside readers: an answer, or an error of tf2."""
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
