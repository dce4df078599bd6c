# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A shared tree answers like a buffer that received the same transforms, to the last bit.

A state machine inserts, ends, clears and removes edges, and asks both all questions. It also reads
from a second tree that attaches late, and from one that looks rarely.
"""

from contextlib import ExitStack
import functools
from unittest import mock

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule, RuleBasedStateMachine
import numpy as np
from sharing_trees import shared, SharingBuffer
from tf_tree_py import BufferCore, from_seconds, Pose, Poses, TransformException
from tf_tree_py.core import Sample
from tf_tree_py.shared.memory import Memory
from tf_tree_py.shared.shared_tree import SharedTree

FRAMES = ['map', 'odom', 'base', 'arm', 'camera']
CACHE_TIME = from_seconds(1.0)
MS = CACHE_TIME // 1_000


def times(first, last):
    """Return whole milliseconds, as nanoseconds."""
    return st.integers(first, last).map(lambda number: number * MS)


frames = st.sampled_from(FRAMES)
# Usually those of one tree, so that each is changed many times.
usual = st.sampled_from([('map', 'odom'), ('odom', 'base'), ('base', 'camera')])
edges = st.one_of(usual, usual, usual,
                  st.tuples(frames, frames).filter(lambda edge: edge[0] != edge[1]))
authorities = st.sampled_from(['one', 'two'])
# So the same edges come again, their stamps in order, most of the time.
steps = st.one_of(
    times(1, 40), times(1, 40), st.just(0), times(-60, -1),
    st.sampled_from([-CACHE_TIME, CACHE_TIME - 1, CACHE_TIME, CACHE_TIME + 1, 3 * CACHE_TIME]))
# Each edge that moves sends up to so many samples at once: enough to fill blocks.
lengths = st.sampled_from([1, 1, 2, 30, 300])


def pose_at(number):
    """Return a pose that no other sample has, with a rotation."""
    angle = 0.7 * number
    return Pose(float(number), 1.0, 2.0, 0.0, float(np.sin(angle)), 0.0, float(np.cos(angle)))


def answer(ask):
    """Return the answer to a question, or all that its error says."""
    try:
        answered = ask()
    except TransformException as error:
        return type(error), str(error)
    return np.asarray(answered).tobytes() if isinstance(answered, np.ndarray | Poses) else answered


def contents(tree):
    return tree.frames(), tree.edges(), {
        frame: tree.stamps_of(frame).tolist() for frame in FRAMES}


class SharedTreeModel(RuleBasedStateMachine):
    """A buffer, the same buffer shared, and those that look up in it."""

    @initialize()
    def begin(self):
        self.stamp = 10_000 * MS
        self.number = 0
        self.exits = ExitStack()
        # Memory is used again at once.
        self.exits.enter_context(mock.patch.object(Memory, 'keep_s', 0.0))
        self.model = BufferCore(CACHE_TIME, now=lambda: 0, max_frames=4)
        self.buffer = SharingBuffer(CACHE_TIME, now=lambda: 0, max_frames=4)
        self.domain_id, self.sharing = self.exits.enter_context(shared(self.buffer))
        self.tree = self.exits.enter_context(SharedTree(domain_id=self.domain_id))
        self.rare = self.exits.enter_context(SharedTree(domain_id=self.domain_id))

    def teardown(self):
        if hasattr(self, 'exits'):
            self.exits.close()

    def both(self, change):
        assert answer(lambda: change(self.buffer)) == answer(lambda: change(self.model))

    def next_pose(self):
        self.number += 1
        return pose_at(self.number)

    @rule(some=st.lists(st.tuples(edges, steps), min_size=1, max_size=4), authority=authorities)
    def insert(self, some, authority):
        samples = []
        for (parent, child), step in some:
            self.stamp += step
            samples.append(Sample(parent, child, self.stamp, self.next_pose()))
        self.both(lambda buffer: buffer.insert_many(samples, authority, strict=False))

    @rule(edge=edges, step=steps, length=lengths, interval=times(0, 9),
          turned=st.booleans())
    def insert_track(self, edge, step, length, interval, turned):
        stamps = self.stamp + step + interval * np.arange(length)
        self.stamp = int(stamps[-1])
        if turned:
            stamps[-2:] = stamps[-2:][::-1]
        poses = [self.next_pose() for _ in stamps]
        self.both(lambda buffer: buffer.insert_track(*edge, stamps, poses, strict=False))

    @rule(edge=edges, step=times(0, 20), length=lengths)
    def insert_one_by_one(self, edge, step, length):
        for _ in range(length):
            self.stamp += step
            self.insert_at(edge, self.stamp)

    def insert_at(self, edge, stamp):
        pose = self.next_pose()
        self.both(lambda buffer: buffer.insert(*edge, stamp, pose, strict=False))

    @rule(edge=usual, back=st.one_of(times(1, 999), times(990, 1_010)))
    def insert_late(self, edge, back):
        stamps = self.model.stamps_of(edge[1])
        if len(stamps):
            self.insert_at(edge, int(stamps[-1]) - back)

    @rule(edge=edges, authority=authorities, number=st.integers(1, 2))
    def insert_static(self, edge, authority, number):
        self.both(lambda buffer: buffer.insert(
            *edge, 0, pose_at(number), static=True, authority=authority, strict=False))

    @rule()
    def fall_silent(self):
        """After this time, an edge may be reversed."""
        self.stamp += 60 * CACHE_TIME

    @rule()
    def clear(self):
        self.both(lambda buffer: buffer.clear())

    @rule()
    def start_anew(self):
        self.stamp = 5_000 * MS
        self.both(lambda buffer: buffer.start_anew('a bag began again'))

    @rule(frame=frames)
    def remove(self, frame):
        self.both(lambda buffer: buffer.remove_frame(frame))

    @rule()
    def attach(self):
        """Show the same in a tree that attaches late."""
        with SharedTree(domain_id=self.domain_id) as late:
            assert contents(late) == contents(self.model)
            self.compare(late, self.stamp)

    @precondition(lambda self: self.number % 3 == 0)
    @rule(back=times(0, 1_000))
    def look_rarely(self, back):
        self.compare(self.rare, self.stamp - back)

    @rule(back=times(-30, 1_100))
    def look_back(self, back):
        self.compare(self.tree, self.stamp - back)

    def same(self, ask):
        """Compare an answer, or all that its error says."""
        assert answer(lambda: ask(self.tree)) == answer(lambda: ask(self.model))

    @rule(edge=usual, ahead=times(1, 200))
    def look_ahead(self, edge, ahead):
        """Predict from earlier samples, which may have changed since the last prediction."""
        info = next((info for info in self.model.edges() if info.child == edge[1]), None)
        if info is not None and info.samples > 3:
            self.same(lambda tree: str(tree.predict(
                info.parent, info.child, info.latest + ahead, 300 * MS)))

    @rule(three=st.tuples(frames, frames, frames),
          backs=st.tuples(times(-5, 1_000), times(-5, 1_000)))
    def look_in_full(self, three, backs):
        target, source, fixed = three
        stamps = [self.stamp - back for back in backs]
        many = np.arange(*sorted(stamps), 7 * MS)
        self.same(lambda tree: tree.lookup_full(target, stamps[0], source, stamps[1], fixed))
        self.same(lambda tree: tree.lookup_many(target, source, many, outside='mask')[1])
        self.same(lambda tree: tree.lookup_many(target, source, many))
        self.same(lambda tree: tree.latest_common_time(target, source))
        self.same(lambda tree: tree.samples_around(source, stamps[0]))
        self.same(lambda tree: tree.edges_between(target, source, stamps[0]))

    @rule(pair=st.one_of(usual, st.tuples(frames, frames)),
          backs=st.lists(times(-1, 999), min_size=2, max_size=9))
    def look_again_and_again(self, pair, backs):
        """Look up one pair: after the first lookup, many of its poses are known."""
        for back in backs:
            stamp = self.stamp - back
            self.same(lambda tree, stamp=stamp: tree.lookup(*pair, stamp))
        self.same(lambda tree: tree.lookup(*pair))

    @rule()
    def keep_a_snapshot(self):
        """Keep one that stays as it is."""
        snapshot, expected = self.tree.snapshot(), self.model.snapshot()
        self.insert_one_by_one(('map', 'odom'), 5 * MS, 300)
        assert contents(snapshot) == contents(expected)
        stamp = self.stamp - 1_400 * MS
        assert answer(lambda: snapshot.lookup_tree('map', stamp)) == answer(
            lambda: expected.lookup_tree('map', stamp))

    @rule()
    def look_everywhere(self):
        assert contents(self.tree) == contents(self.model)
        self.compare(self.tree, 0)

    @invariant()
    def answers_the_same(self):
        """Ask little, so that most edges are left as they were many states ago."""
        if hasattr(self, 'tree'):
            target, source = FRAMES[self.number % 2], FRAMES[2 + self.number % 3]
            stamp = self.stamp - 37 * self.number % 1_100 * MS
            self.same(lambda tree: tree.lookup(target, source, stamp))

    def compare(self, tree, stamp):
        def all_answers(tree):
            pairs = [answer(functools.partial(tree.lookup, target, source, stamp))
                     for target in FRAMES for source in FRAMES for _ in ('found', 'known')]
            trees = [answer(functools.partial(tree.lookup_tree, frame, stamp)) for frame in FRAMES]
            return pairs, trees, tree.parents_at(stamp)

        assert all_answers(tree) == all_answers(self.model)


TestSharedTree = SharedTreeModel.TestCase
TestSharedTree.settings = examples(3, stateful_step_count=40)
