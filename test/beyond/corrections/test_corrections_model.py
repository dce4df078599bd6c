# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Corrections in any order of operations: results are final, rates limited, goals reached.

A robot drives in circles, or stands. It is corrected at random, at rates from 1 to 100 Hz, with
different limits and about different points. Samples come late. The robot changes its source and
its parent. Time starts again, or stamps jump back. Trees are copied, and saved as files. Every
step checks all guarantees of corrections.
"""

from bisect import bisect_left, bisect_right, insort
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import (
    initialize,
    invariant,
    precondition,
    rule,
    RuleBasedStateMachine,
)
import numpy as np
from strategies import assert_same_pose
from tf_tree_py import BufferCore, load
from tf_tree_py.beyond.corrections.blend import BlendLimits, scale_of
from tf_tree_py.core import Kind, Pose, se3

SECOND = 1_000_000_000
MS = 1_000_000
STEP = 10 * MS
CACHE_TIME = 3 * SECOND
PARENTS = ('odom', 'lift')
LIMITS = [BlendLimits(SECOND // 2, math.inf, math.inf, 0.0),
          BlendLimits(SECOND // 2, 0.5, math.inf, 0.0),
          BlendLimits(300 * MS, 0.4, 0.3, 0.0), BlendLimits(200 * MS, 0.6, 0.5, 1.0),
          BlendLimits(0, 0.3, math.inf, 0.0), BlendLimits(0, math.inf, math.inf, 0.0)]
POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-0.3, 0.4, 0.2)]
SOURCES = {'wheels': Pose(), 'visual': Pose.from_xyz_rpy(x=0.3, y=-0.4, yaw=0.2)}
OWN = np.diag([1e-4] * 6)

parts = st.integers(-80, 80).map(lambda number: number / 100)
goals = st.builds(lambda x, y, yaw, roll: Pose.from_xyz_rpy(x=x, y=y, yaw=yaw, roll=roll),
                  parts, parts, parts, parts)
some_limits, some_points = st.sampled_from(LIMITS), st.sampled_from(POINTS)


class Sent(NamedTuple):
    """A correction as it was sent, or a switch of the source."""

    goal: Pose
    about: tuple[float, float, float]
    limits: BlendLimits


class CorrectedEdge(RuleBasedStateMachine):
    """An edge, its original samples, and all results of lookups."""

    @initialize(turns=st.sampled_from([0.0, 2.0]), sources=st.booleans(), jumps=st.booleans())
    def begin(self, turns, sources, jumps):
        self.turns, self.source, self.jumps = turns, 'wheels' if sources else None, jumps
        self.buffer = BufferCore(CACHE_TIME, clear_on_jump_back=SECOND // 2 if jumps else None)
        self.buffer.insert('base', 'camera', 0, POINTS[1] + (0, 0, 0, 1), static=True)
        self.now, self.snapshot = 0, None
        self.limits, self.about = LIMITS[1], POINTS[0]
        self.forget()
        self.drive(3)

    def forget(self):
        """Forget everything when time has started again."""
        self.raw, self.stamps, self.answered = {}, [], {}
        self.parent, self.change = 'odom', None
        # What was sent last, by parent: each has its own transition.
        self.sent = {}
        # By stamp: the remaining angle of the correction at it or at the stamp before.
        self.left = {}
        # The stamp from which the current parent, its limits and point, and the source apply.
        self.since = self.now

    def motion(self, stamp):
        """Return the robot's pose from an odometry: it stands, or drives in circles."""
        t = self.turns * stamp / SECOND
        return SOURCES[self.source or 'wheels'] @ Pose.from_xyz_rpy(
            x=math.sin(t), y=1.0 - math.cos(t), yaw=t)

    # --- samples

    def insert(self, stamp):
        if self.source is None:
            return self.buffer.insert(self.parent, 'base', stamp, self.motion(stamp), strict=False,
                                      covariance=OWN)
        return sum((self.buffer.insert_from(
            name, 'odom', 'base', stamp,
            aside @ SOURCES[self.source].inverse() @ self.motion(stamp))
            for name, aside in SOURCES.items()), [])

    @rule(count=st.integers(1, 12))
    def drive(self, count):
        for _ in range(count):
            self.now += STEP
            self.insert(self.now)
            insort(self.stamps, self.now)
            self.raw[self.now] = self.parent, self.motion(self.now)
            if len(self.stamps) > 1:
                self.note(self.now)
                self.left[self.now] = max(map(self.angle_left, self.stamps[-2:]))
                if not self.now % (7 * STEP):
                    self.note(self.now - 3 * MS)

    def angle_left(self, stamp):
        parent, raw = self.raw[stamp]
        goal = self.goal_of(parent) @ raw
        return se3.distance(self.answered.get(stamp, (goal,))[0], goal)[1]

    def ask(self, tree, stamp):
        """Return the pose, and at some stamps the covariance, which takes much longer."""
        parent = self.parent_at(stamp)
        if stamp // STEP % 5:
            return tree.lookup_at(parent, 'base', stamp), np.zeros((6, 6))
        return tree.lookup_uncertain(parent, 'base', stamp)[:2]

    def parent_at(self, stamp):
        return self.raw[self.stamps[bisect_right(self.stamps, stamp) - 1]][0]

    def note(self, stamp):
        self.answered[stamp] = self.ask(self.buffer, stamp)

    @precondition(lambda self: len(self.stamps) > 3 and self.source is None)
    @rule(back=st.integers(1, 3), extra=st.integers(1, 9))
    def insert_late(self, back, extra):
        """Insert one that may change the poses between its neighbours, as in tf2."""
        stamp = self.stamps[-back - 1] + extra * MS
        if stamp in self.raw or stamp > self.stamps[-1]:
            return
        place = bisect_left(self.stamps, stamp)
        if self.raw[self.stamps[place - 1]][0] != self.parent:
            return
        before, after = self.stamps[place - 1], self.stamps[place]
        self.answered = {when: answer for when, answer in self.answered.items()
                         if not before < when < after}
        self.insert(stamp)
        self.raw[stamp] = self.parent, self.motion(stamp)
        self.left[stamp] = self.left[after]
        insort(self.stamps, stamp)
        self.note(stamp)

    # --- corrections

    def goal_of(self, parent):
        return self.sent[parent].goal if parent in self.sent else Pose()

    def correct(self, goal):
        options = self.limits._asdict()
        self.change = self.buffer.correct('base', goal, about=self.about, **options)
        before = self.sent.get(self.parent)
        self.sent[self.parent] = Sent(goal, self.about, self.limits)
        if before and before[1:] != self.sent[self.parent][1:]:
            self.since = self.now

    @rule(goal=goals)
    def correct_once(self, goal):
        self.correct(goal)

    @rule(goal=goals, every=st.sampled_from([1, 3, 10]), noise=st.sampled_from([0.0, 0.001, 0.01]),
          seed=st.integers(0, 99))
    def correct_often(self, goal, every, noise, seed):
        rng = np.random.default_rng(seed)
        for _ in range(30 // every):
            x, y, yaw = rng.normal(0.0, noise, 3).tolist()
            self.correct(Pose.from_xyz_rpy(x=x, y=y, yaw=yaw) @ goal)
            self.drive(every)

    @rule(goal=goals)
    def correct_within_reach(self, goal):
        self.change_limits(LIMITS[3], self.about)
        self.correct(goal)
        self.drive(30)

    @precondition(lambda self: self.parent in self.sent)
    @rule(opposite=st.booleans())
    def correct_again(self, opposite):
        """Send it again, perhaps with the opposite quaternion, which is the same rotation."""
        change, version, goal = self.change, self.buffer.corrections_version, self.goal_of(
            self.parent)
        # With another parent, the robot may have got other limits and another point.
        is_same = self.sent[self.parent][1:] == (self.about, self.limits)
        self.correct(Pose(*goal[:3], *(-part for part in goal[3:])) if opposite else goal)
        assert not is_same or (
            change in (None, self.change) and self.buffer.corrections_version == version)

    @rule(limits=some_limits, about=some_points)
    def change_limits(self, limits, about):
        self.limits, self.about = limits, about
        self.correct(self.goal_of(self.parent))

    @rule(goal=goals, regret=st.booleans())
    def jump(self, goal, regret):
        """End a blend by a jump, at a stamp whose covariance was looked up; or blend after all."""
        self.change_limits(LIMITS[0], self.about)
        self.correct(goal)
        self.drive(5)
        while self.now // STEP % 5:
            self.drive(1)
        self.change_limits(LIMITS[5], self.about)
        if regret:
            self.change_limits(LIMITS[0], self.about)
            self.drive(1)
            here, before = (self.answered[stamp][0] for stamp in (self.now, self.now - STEP))
            assert se3.distance(before, here)[0] < 0.25, 'it has jumped'

    @precondition(lambda self: self.source is not None)
    @rule()
    def switch(self):
        self.source = 'visual' if self.source == 'wheels' else 'wheels'
        self.change = self.buffer.switch('base', to=self.source, **self.limits._asdict())
        self.about, self.since = POINTS[0], self.now
        self.sent = {'odom': Sent(Pose(), self.about, self.limits)}

    # --- other operations

    @precondition(lambda self: self.source is None)
    @rule()
    def change_parent(self):
        self.parent, self.change = PARENTS[self.parent == 'odom'], None
        self.since = self.now + STEP
        self.drive(2)

    @rule(back=st.integers(0, 3))
    def begin_anew(self, back):
        """Clear the buffer, or let it clear itself after stamps have jumped back for 1 s."""
        before, self.now = self.now, max(self.now - back * SECOND, 0)
        if not self.jumps or back < 2 or before - self.now < 2 * SECOND:
            self.buffer.clear()
            self.source = self.source and 'wheels'
            self.forget()
        else:
            self.parent, kinds = 'odom', set()
            while Kind.JUMP_BACK not in kinds:
                self.now += STEP
                kinds = {incident.kind for incident in self.insert(self.now)}
                assert self.now < before - SECOND // 2
            self.source = self.source and 'wheels'
            self.forget()
            self.stamps, self.raw = [self.now], {self.now: (self.parent, self.motion(self.now))}
        self.drive(3)

    @rule(saved=st.booleans())
    def snapshot(self, saved):
        stamps = list(self.answered)[-30:]
        tree = self.buffer.snapshot()
        if saved:
            with TemporaryDirectory() as folder:
                tree.save(Path(folder) / 'tree')
                tree = load(Path(folder) / 'tree')
        self.snapshot = tree, [
            (stamp, self.parent_at(stamp), self.answered[stamp]) for stamp in stamps]

    @rule()
    def wait(self):
        """Drive until the goal is reached, for a bounded time."""
        if self.change is not None:
            while self.now <= self.change.end and self.now - self.change.begin < 20 * SECOND:
                self.drive(20)
                self.expire()
            assert self.change.end < self.now
            assert_same_pose(self.buffer.lookup_at(self.parent, 'base', self.now),
                             self.goal_of(self.parent) @ self.motion(self.now), 1e-9)

    # --- the guarantees

    @invariant()
    def expire(self):
        horizon = self.now - CACHE_TIME + SECOND
        self.answered = {stamp: answer for stamp, answer in self.answered.items()
                         if stamp >= horizon}

    @invariant()
    def no_answer_changes(self):
        for stamp, (pose, covariance) in list(self.answered.items())[::-3]:
            again = self.ask(self.buffer, stamp)
            assert again[0] == pose
            np.testing.assert_allclose(again[1], covariance, rtol=1e-9, atol=1e-11)
        if self.snapshot:
            for stamp, parent, (pose, covariance) in self.snapshot[1]:
                assert self.snapshot[0].lookup_at(parent, 'base', stamp) == pose
                if covariance.any():
                    again = self.snapshot[0].lookup_uncertain(parent, 'base', stamp)[1]
                    np.testing.assert_allclose(again, covariance, rtol=1e-9, atol=1e-11)

    @invariant()
    def nothing_is_faster_than_stated(self):
        """
        Compare turns, and the speeds of points, with those of the original samples.

        A point at a lever s from ``about`` is at G a + d + Q G s: G is its goal, whose turn w and
        speed are those of the original samples; the offset d of ``about`` and the rotation Q by
        the angle that is left decrease to zero. So its velocity is that of G (a + s), and d' +
        q x Q G s of the blend, which is within the limits, and (Q - 1) (w x G s). The norm of
        the last is at most 2 sin(angle / 2) w |s|. The same holds for differences of samples,
        with the angle at either of them. At ``about`` the lever is zero.
        """
        _, about, limits = self.sent.get(self.parent, Sent(Pose(), self.about, self.limits))
        scale = scale_of(limits)
        since = self.since + round(0.5 * scale.seconds * SECOND)
        since = max(since, self.stamps[0], self.now - SECOND)
        stamps = [stamp for stamp in self.stamps if stamp >= since]
        if len(stamps) < 2 or not scale.seconds:
            return
        here = np.array([self.answered[stamp][0] for stamp in stamps])
        raw = np.array([self.raw[stamp][1] for stamp in stamps])
        seconds = np.diff(stamps) / SECOND
        turned = se3.distance_many(here[:-1], here[1:])[1] / seconds
        own_turn = se3.distance_many(raw[:-1], raw[1:])[1] / seconds
        assert (turned - own_turn <= limits.max_turn_rate + 1e-6).all()
        left = np.array([self.left[stamp] for stamp in stamps[1:]])
        gain = 2.0 * np.sin(0.5 * left) * own_turn * limits.reach
        for lever, more in ((np.zeros(3), 0.0), *((lever, gain) for lever in (
                limits.reach * np.eye(3)))):
            assert (self.excess(here, raw, about + lever) / seconds
                    <= limits.max_speed + more + 1e-6).all()

    @invariant()
    def without_a_correction_samples_are_as_they_came(self):
        stamp = self.stamps[-1]
        parent, raw = self.raw[stamp]
        if parent not in self.sent:
            assert_same_pose(self.buffer.lookup_at(parent, 'base', stamp), raw, 1e-9)

    def excess(self, here, raw, point):
        """Return how much farther a point moves than in the original samples."""
        point = np.broadcast_to(point, (len(here), 3))
        ways = [np.linalg.norm(np.diff(se3.apply_many(poses, point), axis=0), axis=1)
                for poses in (here, raw)]
        return ways[0] - ways[1]

    @invariant()
    def all_lookups_agree(self):
        stamps = [stamp for stamp in self.answered
                  if stamp >= self.since and self.parent_at(stamp) == self.parent
                  and not stamp // STEP % 5][-4:]
        if not stamps:
            return
        many, covariances = self.buffer.lookup_uncertain_many(self.parent, 'base', stamps)
        still = self.buffer.snapshot()
        for number, stamp in enumerate(stamps):
            pose, covariance = self.answered[stamp]
            assert_same_pose(pose, many[number], 1e-12)
            assert_same_pose(pose, self.buffer.lookup_tree(self.parent, stamp)['base'], 1e-12)
            np.testing.assert_allclose(covariances[number], covariance, rtol=1e-6, atol=1e-10)
            again = self.ask(still, stamp)
            assert again[0] == pose
            np.testing.assert_allclose(again[1], covariance, rtol=1e-6, atol=1e-10)


TestCorrectedEdge = CorrectedEdge.TestCase
TestCorrectedEdge.settings = examples(1, stateful_step_count=15)
