# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer compared with twenty lines of homogeneous matrices, on random trees."""

from bisect import bisect_right
import functools
import itertools
import random

from hypothesis import given, strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from strategies import random_poses
from tf_tree_py import BufferCore
from tf_tree_py.core import ExtrapolationException, LATEST, Sample
from tf_tree_py.core.geometry import se3

CACHE_TIME = 1000
IDENTITY = np.eye(4)


class Oracle:
    """Each edge's samples, by child, and the textbook algorithm for lookups."""

    def __init__(self, edges, static):
        self.edges, self.static = edges, static

    def chain(self, frame):
        """Return the frame and its ancestors."""
        return [frame, *self.chain(self.edges[frame][0])] if frame in self.edges else [frame]

    def edge_at(self, child, stamp):
        """Return parent_T_child, interpolated between the samples around a stamp."""
        stamps, poses = self.edges[child][1:]
        after = min(bisect_right(stamps, stamp), len(stamps) - 1)
        if child in self.static or stamps[after] <= stamp:
            return se3.as_matrix(poses[-1])
        span = [stamps[after - 1], stamps[after]]
        ratio = (stamp - span[0]) / (span[1] - span[0])
        matrix = np.eye(4)
        matrix[:3, 3] = (1 - ratio) * poses[after - 1, :3] + ratio * poses[after, :3]
        rotations = Rotation.from_quat(poses[after - 1:after + 1, 3:])
        matrix[:3, :3] = Slerp(span, rotations)(stamp).as_matrix()
        return matrix

    def lookup(self, target, source, stamp):
        """Climb from both to the lowest common ancestor; invert the target's branch."""
        above_target, above_source = self.chain(target), self.chain(source)
        ancestor = next(frame for frame in above_source if frame in above_target)
        branches = [chain[:chain.index(ancestor)] for chain in (above_target, above_source)]
        top_T_target, top_T_source = (
            functools.reduce(np.matmul, [self.edge_at(child, stamp) for child in branch[::-1]],
                             IDENTITY) for branch in branches)
        return np.linalg.inv(top_T_target) @ top_T_source

    def rounding(self):
        """Return the tolerance of an answer: it grows with the metres that are added up."""
        return 1e-14 * (1.0 + sum(np.abs(poses[:, :3]).max() for _, _, poses
                                  in self.edges.values()))

    def moving(self, a, b):
        """Return the moving edges between two frames."""
        return (set(self.chain(a)) ^ set(self.chain(b))) & self.edges.keys() - self.static


@st.composite
def trees(draw):
    """Draw a random tree with rotations: static and moving edges, each with its own stamps."""
    count = draw(st.integers(2, 9))
    rng = np.random.default_rng(draw(st.integers(0, 2 ** 32)))
    edges, static = {}, set()
    for i in range(1, count):
        stamps = sorted(draw(st.sets(st.integers(100, 140), min_size=1, max_size=6)) | {120, 121})
        if draw(st.booleans()):
            static.add(f'f{i}')
            stamps = [0]
        parent = f'f{draw(st.integers(0, i - 1))}'
        edges[f'f{i}'] = (parent, stamps, random_poses(rng, len(stamps), reach=10.0))
    return Oracle(edges, static), draw(st.randoms(use_true_random=False))


def samples_of(oracle, static):
    return [
        Sample(parent, child, stamp, tuple(pose))
        for child, (parent, stamps, poses) in oracle.edges.items()
        if (child in oracle.static) == static
        for stamp, pose in zip(stamps, poses.tolist(), strict=True)
    ]


def buffer_of(oracle, order=None):
    """Return a buffer with the samples of the tree, inserted in order of time or shuffled."""
    buffer = BufferCore(CACHE_TIME)
    assert not buffer.insert_many(samples_of(oracle, True), static=True)
    samples = samples_of(oracle, False)
    samples.sort(key=lambda sample: sample.stamp)
    if order is not None:
        order.shuffle(samples)
    for sample in samples:
        assert not buffer.insert_many([sample])
    return buffer


def assert_as_oracle(oracle, buffer, target, source, stamp):
    moving = oracle.moving(target, source)
    spans = [oracle.edges[child][1] for child in moving]
    if any(not stamps[0] <= stamp <= stamps[-1] for stamps in spans):
        with pytest.raises(ExtrapolationException):
            buffer.lookup(target, source, stamp)
        return
    found = buffer.lookup(target, source, stamp).as_matrix()
    assert found == pytest.approx(oracle.lookup(target, source, stamp), abs=oracle.rounding())


@given(trees(), st.integers(98, 142))
def test_every_lookup_is_that_of_the_oracle(tree, stamp):
    oracle, _ = tree
    buffer = buffer_of(oracle)
    for target, source in itertools.permutations(buffer.frames(), 2):
        assert_as_oracle(oracle, buffer, target, source, stamp)
        # Again, over the path that the first lookup has cached.
        assert_as_oracle(oracle, buffer, target, source, 120)


@given(trees())
def test_latest_is_the_newest_stamp_that_all_moving_edges_have(tree):
    oracle, _ = tree
    buffer = buffer_of(oracle)
    for target, source in itertools.permutations(buffer.frames(), 2):
        newest = [oracle.edges[child][1][-1] for child in oracle.moving(target, source)]
        common = min(newest, default=LATEST)
        assert buffer.latest_common_time(target, source) == common
        stamp, pose = buffer.lookup_stamped(target, source)
        assert stamp == common
        expected = oracle.lookup(target, source, common)
        assert se3.as_matrix(pose) == pytest.approx(expected, abs=oracle.rounding())


@given(trees())
def test_order_of_arrival_inside_the_window_does_not_matter(tree):
    oracle, order = tree
    expected, shuffled = buffer_of(oracle), buffer_of(oracle, order)
    for target, source in itertools.permutations(expected.frames(), 2):
        for stamp in (LATEST, *range(99, 142, 7), 120):
            answers = []
            for buffer in (expected, shuffled):
                try:
                    answers.append(buffer.lookup_stamped(target, source, stamp))
                except ExtrapolationException as error:
                    answers.append((type(error), error.child))
            assert answers[0] == answers[1]


@given(trees(), st.integers(120, 121), st.integers(120, 121))
def test_lookup_through_a_fixed_frame_is_two_of_the_oracle(tree, target_stamp, source_stamp):
    oracle, order = tree
    buffer = buffer_of(oracle)
    target, source, fixed = (order.choice(buffer.frames()) for _ in range(3))
    expected = (oracle.lookup(target, fixed, target_stamp)
                @ oracle.lookup(fixed, source, source_stamp))
    found = buffer.lookup_full(target, target_stamp, source, source_stamp, fixed)
    assert found.as_matrix() == pytest.approx(expected, abs=oracle.rounding())


def test_chain_of_a_thousand_frames_is_walked():
    rng = np.random.default_rng(1)
    poses = random_poses(rng, 1000)
    buffer = BufferCore()
    order = list(enumerate(poses.tolist()))
    random.Random(2).shuffle(order)
    buffer.insert_many(
        Sample(f'f{i}', f'f{i + 1}', 5, tuple(pose)) for i, pose in order)
    expected = functools.reduce(np.matmul, se3.as_matrix_many(poses))
    assert buffer.lookup('f0', 'f1000', 5).as_matrix() == pytest.approx(expected, abs=1e-10)
    assert buffer.lookup('f1000', 'f0', 5).as_matrix() == pytest.approx(
        np.linalg.inv(expected), abs=1e-10)
