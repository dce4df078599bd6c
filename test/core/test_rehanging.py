# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Trees whose frames change parents repeatedly, compared with a list of all samples.

At every stamp, the parent of a frame is that of its sample at or before the stamp, if
there is also a later sample; otherwise it has none. There is never a loop.
"""

from bisect import bisect_right
import itertools

from effort import examples
from hypothesis import example, given, strategies as st
import numpy as np
import pytest
from strategies import assert_same_pose, random_poses
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ConnectivityException,
    ExtrapolationException,
    Kind,
    LookupException,
    Pose,
)
from tf_tree_py.core.geometry import se3

FRAMES = 'abcde'
LONG = 10_000
NO_ANSWER = ConnectivityException, ExtrapolationException
POSES = random_poses(np.random.default_rng(3), 64).tolist()


class Oracle:
    """Every inserted sample, by child, in order of time; and the ends of edges."""

    def __init__(self):
        self.samples = {}
        self.ends = set()

    def insert(self, parent, child, stamp, pose):
        samples = self.samples.setdefault(child, [])
        samples.insert(bisect_right([kept for kept, *_ in samples], stamp), (stamp, parent, pose))
        self.ends.discard((child, stamp))

    def end(self, child):
        self.ends.add((child, self.samples[child][-1][0]))

    def along(self, edges, source, stamp):
        """Return end_T_source along edges that are connected at a stamp."""
        product, frame = se3.IDENTITY, source
        for edge in edges:
            parent, pose = self.edge_at(edge.child, stamp)
            assert edge.parent == parent
            assert frame in (edge.child, parent)
            frame = parent if (upwards := frame == edge.child) else edge.child
            product = se3.compose(pose if upwards else se3.inverse(pose), product)
        return product

    def edge_at(self, child, stamp):
        """Return the parent and parent_T_child; None where there is no data."""
        samples = self.samples.get(child, [])
        after = bisect_right([kept for kept, *_ in samples], stamp)
        if after == 0:
            return None
        older, parent, pose = samples[after - 1]
        if older == stamp:
            return parent, pose
        if after == len(samples) or (child, older) in self.ends:
            return None
        newer, next_parent, next_pose = samples[after]
        if parent != next_parent:
            return parent, pose
        return parent, se3.interpolate(pose, next_pose, (stamp - older) / (newer - older))

    def way_up(self, frame, stamp):
        """Return top_T_frame for the frame and all its ancestors, by name."""
        poses = {frame: se3.IDENTITY}
        while (edge := self.edge_at(frame, stamp)) is not None:
            parent, pose = edge
            assert parent not in poses, f'a loop at {stamp}'
            poses[parent] = se3.compose(pose, poses[frame])
            frame = parent
        return poses

    def lookup(self, target, source, stamp):
        """Return target_T_source; None if the two are not connected."""
        from_source, from_target = self.way_up(source, stamp), self.way_up(target, stamp)
        meeting = next((frame for frame in from_source if frame in from_target), None)
        if meeting is None:
            return None
        return se3.compose(se3.inverse(from_target[meeting]), from_source[meeting])


@st.composite
def histories(draw):
    """Draw changes of parents over time; mostly in order, some late or with silence."""
    arrivals, now = [], 0
    for _ in range(draw(st.integers(1, 8))):
        now += draw(st.sampled_from([1, 2, 5, 30]))
        edges = draw(st.lists(st.tuples(st.sampled_from(FRAMES), st.sampled_from(FRAMES)),
                              min_size=1, max_size=4))
        back = draw(st.sampled_from([0, 0, 0, 1, 7]))
        arrivals += [(parent, child, now - back) for parent, child in edges]
    return arrivals


def answer(look, *arguments):
    try:
        return look(*arguments)
    except NO_ANSWER:
        return None


def fed(arrivals, cache_time):
    """Return a buffer with the arrivals, and an oracle of the accepted ones."""
    buffer, oracle = BufferCore(cache_time), Oracle()
    for number, (parent, child, stamp) in enumerate(arrivals):
        pose = tuple(POSES[number % len(POSES)])
        before = {edge.child for edge in buffer.edges()}
        told = buffer.insert(parent, child, stamp, pose)
        if any(incident.refused for incident in told):
            continue
        if any(incident.kind is Kind.SILENT_EDGE_ENDED for incident in told):
            for gone in before - {edge.child for edge in buffer.edges()}:
                oracle.end(gone)
        oracle.insert(parent, child, stamp, pose)
    return buffer, oracle


# In seconds, edges become silent; in nanoseconds, they do not. The window never expires.
@examples(2)
@given(histories(), st.sampled_from([1, 10 ** 9]))
# A late sample arrives exactly at the end of the edge.
@example([('a', 'b', 1), ('b', 'a', 6), ('c', 'b', 7), ('c', 'b', 1)], 10 ** 9)
def test_every_answer_is_that_of_the_samples(arrivals, unit):
    arrivals = [(parent, child, stamp * unit) for parent, child, stamp in arrivals]
    buffer, oracle = fed(arrivals, LONG * unit)
    stamps = sorted({stamp + step * unit for *_, stamp in arrivals for step in (-1, 0, 1)})
    frames = buffer.frames()
    for stamp in stamps:
        for frame in frames:
            oracle.way_up(frame, stamp)
    for target, source in itertools.permutations(frames, 2):
        expected = [oracle.lookup(target, source, stamp) for stamp in stamps]
        fresh, kept = [], []
        for stamp in stamps:
            fresh.append(answer(buffer.snapshot().lookup_at, target, source, stamp))
            kept.append(answer(buffer.lookup_at, target, source, stamp))
        assert_same_answers(fresh, expected)
        assert_same_answers(kept, expected)
        assert_same_answers(many(buffer, target, source, stamps), expected)
        for stamp, pose in zip(stamps, expected, strict=True):
            if stamp:  # 0 means the latest
                edges = answer(buffer.edges_between, target, source, stamp)
                assert (edges is None) == (pose is None)
                if edges is not None:
                    assert_same_pose(oracle.along(edges, source, stamp), pose)
        # The latest is not compared, but it met no loop.
        answer(buffer.lookup, target, source)
    for target, stamp in itertools.product(frames, filter(None, stamps)):
        everything = buffer.lookup_tree(target, stamp)
        for source in frames:
            assert_same_answers([everything.get(source)], [oracle.lookup(target, source, stamp)])


def many(buffer, target, source, stamps):
    try:
        poses, valid = buffer.lookup_many(target, source, stamps, outside='mask')
    except ConnectivityException:
        return [None] * len(stamps)
    return [tuple(pose) if known else None for pose, known in zip(poses, valid, strict=True)]


def assert_same_answers(found, expected):
    assert [pose is None for pose in found] == [pose is None for pose in expected]
    for pose, other in zip(found, expected, strict=True):
        if other is not None:
            assert_same_pose(pose, other)


def test_where_only_older_data_joins_two_frames_it_is_found():
    buffer = BufferCore()
    for stamp in (10, 20):
        buffer.insert('map', 'box', stamp, Pose(float(stamp)))
    buffer.insert('shelf', 'box', 30, Pose())
    with pytest.raises(ConnectivityException):
        buffer.lookup('map', 'box')
    assert buffer.lookup('map', 'box', 15) == Pose(15.0)
    poses, valid = buffer.lookup_many('map', 'box', [15, 25, 35], outside='mask')
    assert valid.tolist() == [True, True, False]
    assert poses[0] == pytest.approx(Pose(15.0))
    assert poses[1] == pytest.approx(Pose(20.0))
    with pytest.raises(ExtrapolationException, match=r'stamps\[2\]'):
        buffer.lookup_many('map', 'box', [15, 25, 35])
    with pytest.raises(LookupException):
        buffer.lookup_many('map', 'nowhere', [15], outside='mask')
