# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""No pose that is too old is returned, and none that is fresh is refused, whatever arrives."""

from effort import examples
from hand_clock import HandClock
from hypothesis import strategies as st
from hypothesis.stateful import initialize, rule, RuleBasedStateMachine
import numpy as np
from strategies import poses
from tf_tree_py import BufferCore, LATEST, Linear, StaleException, TransformException, UNLIMITED
from tf_tree_py.core.geometry import se3

START = 1_000
FRAMES = ['map', 'odom', 'base', 'arm', 'tool']
frames = st.sampled_from(FRAMES)
limits = st.sampled_from([0, 1, 5, 20, 100, UNLIMITED])


class Hold(Linear):

    def __init__(self, holds_for):
        self.holds_for = holds_for


class Freshness(RuleBasedStateMachine):
    """A buffer, and what follows from the edges that it lists."""

    def __init__(self):
        super().__init__()
        self.clock = HandClock(START)
        self.holds = {}

    @initialize(default=st.one_of(st.none(), limits))
    def begin(self, default):
        self.buffer = BufferCore(100_000, now=self.clock, max_age=default)

    # --- what happens

    @rule(forwards=st.integers(0, 30))
    def time_passes(self, forwards):
        self.clock.now += forwards

    @rule(now=st.sampled_from([0, 1, START, START + 200]))
    def the_clock_is_set(self, now):
        self.clock.now = now

    @rule(parent=frames, child=frames, age=st.integers(-20, 60), pose=poses,
          static=st.sampled_from([False, False, False, True]))
    def a_sample_arrives(self, parent, child, age, pose, static):
        refused = self.buffer.insert(parent, child, self.clock.now - age, pose, static=static,
                                     strict=False)
        if static and not any(incident.refused for incident in refused):
            self.holds.pop(child, None)

    @rule(number=st.integers(1, 4), age=st.integers(-5, 5), pose=poses)
    def a_chain_arrives(self, number, age, pose):
        for parent, child in zip(FRAMES[:number], FRAMES[1:number + 1], strict=True):
            for stamp in (self.clock.now - age - 10, self.clock.now - age):
                self.buffer.insert(parent, child, stamp, pose, strict=False)

    @rule(child=frames, holds_for=st.sampled_from([0, 7, 50]))
    def an_edge_holds_its_sample(self, child, holds_for):
        try:
            self.buffer.set_interpolation(child, Hold(holds_for))
        except TransformException:
            return  # it is static
        self.holds[child] = holds_for

    @rule(frame=frames)
    def a_frame_is_removed(self, frame):
        if self.buffer.remove_frame(frame):
            self.holds.pop(frame, None)

    @rule()
    def all_is_forgotten(self):
        self.buffer.clear()

    # --- what is asked

    def path(self, target, source):
        """Return the moving edges between two frames, and the pose of their newest samples."""
        above = {edge.child: edge for edge in self.buffer.edges()}
        matrices, edges = [], []
        for frame in source, target:
            matrix, chain = np.eye(4), {frame: np.eye(4)}
            passed = {frame: ()}
            while frame in above:
                edge = above[frame]
                known = (self.buffer.lookup_at(edge.parent, edge.child, edge.latest)
                         if edge.static else
                         self.buffer.samples_around(edge.child, edge.latest)[-1][1])
                matrix = se3.as_matrix(known) @ matrix
                passed[edge.parent] = (*passed[frame], *(() if edge.static else (edge,)))
                frame = edge.parent
                chain[frame] = matrix
            matrices.append(chain)
            edges.append(passed)
        meet = next(frame for frame in matrices[0] if frame in matrices[1])
        pose = np.linalg.inv(matrices[1][meet]) @ matrices[0][meet]
        return edges[0][meet] + edges[1][meet], pose

    def reach(self, edge):
        return edge.latest + self.holds.get(edge.child, 0)

    def is_fresh(self, edges, max_age):
        limit = self.buffer.max_age if max_age is None else max_age
        return not edges or limit in (None, UNLIMITED) or (
            self.clock.now > 0 and self.clock.now - min(map(self.reach, edges)) <= limit)

    def check_error(self, error, edges, max_age):
        limit = self.buffer.max_age if max_age is None else max_age
        assert error.max_age == limit
        now, oldest = self.clock.now, min(map(self.reach, edges))
        assert error.age == (now - oldest if now > 0 else None)
        assert (error.parent, error.child, error.latest) in {
            (edge.parent, edge.child, edge.latest) for edge in edges if self.reach(edge) == oldest}
        assert sorted((edge.child, edge.stamp, edge.age) for edge in error.ages) == sorted(
            (edge.child, edge.latest, now - self.reach(edge)) for edge in edges)
        ages = [edge.age for edge in error.ages]
        assert ages == sorted(ages, reverse=True)
        # It sleeps until each edge that is too old has reached the limit.
        assert dict(error.blocked_on) == {
            edge.child: now - limit if now > 0 else self.reach(edge) + 1 for edge in edges
            if now <= 0 or self.reach(edge) < now - limit}
        assert str(error)

    @rule(frame=frames, source=frames, max_age=st.one_of(st.none(), limits))
    def the_latest_is_asked(self, frame, source, max_age):
        target = frame
        try:
            expected = self.buffer.lookup(target, source, max_age=UNLIMITED)
        except TransformException as error:
            expected = error
        try:
            found = self.buffer.lookup(target, source, LATEST, max_age=max_age)
        except StaleException as error:
            # Also if no edge has data for that time any more.
            edges, _ = self.path(target, source)
            assert not self.is_fresh(edges, max_age)
            self.check_error(error, edges, max_age)
        except TransformException as error:
            assert (type(error), str(error)) == (type(expected), str(expected))
        else:
            assert found == expected
            assert target == source or self.is_fresh(self.path(target, source)[0], max_age)

    @rule(frame=frames, source=frames, max_age=st.one_of(st.none(), limits))
    def the_newest_is_asked(self, frame, source, max_age):
        target = frame
        if target == source:
            assert self.buffer.lookup_newest(target, source, max_age=max_age).stamps == {}
            return
        try:
            edges, pose = self.path(target, source)
        except StopIteration:  # no frame in common
            edges = None
        known = set(self.buffer.frames())
        try:
            found = self.buffer.lookup_newest(target, source, max_age=max_age)
        except StaleException as error:
            assert edges and not self.is_fresh(edges, max_age)
            self.check_error(error, edges, max_age)
        except TransformException:
            assert edges is None or not {target, source} <= known
        else:
            assert self.is_fresh(edges, max_age)
            assert found.stamps == {edge.child: edge.latest for edge in edges}
            scale = 1.0 + np.abs(pose[:3, 3]).max()
            np.testing.assert_allclose(se3.as_matrix(found.pose), pose, atol=1e-8 * scale)


TestFreshness = Freshness.TestCase
TestFreshness.settings = examples(3, stateful_step_count=30)
