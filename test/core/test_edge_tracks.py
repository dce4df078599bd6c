# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Copies of edges for many stamps, compared with single lookups; interpolations; static edges."""

import math

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
from policies import HoldNewest
import pytest
from strategies import assert_same_pose, assert_same_rotation, poses as unit_poses, random_poses
from tf_tree_py.core import InvalidArgumentException, Linear
from tf_tree_py.core.edges.interpolation import (
    checked_interpolation,
    Interpolation,
    is_linear,
    LINEAR,
)
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.edges.tracks import (
    ConstantTrack,
    HeldTrack,
    InterpolatedTrack,
    OneByOneTrack,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.stamp import BEGINNING, FOREVER

HALF = (0.0, 0.0, 1.0, 0.0)


def turned(angle, x=0.0, y=0.0, z=0.0):
    """Return the pose of a rotation about z, at a place."""
    return (x, y, z, 0.0, 0.0, math.sin(0.5 * angle), math.cos(0.5 * angle))


def history_of(stamps, poses):
    history = Samples('child', 10 ** 9)
    for stamp, pose in zip(stamps, poses, strict=True):
        history.insert(stamp, 'p', pose)
    return history


@examples(4)
@given(st.lists(st.tuples(st.integers(0, 30), unit_poses), min_size=1, max_size=6),
       st.booleans())
def test_track_is_the_single_poses(samples, half_turn):
    samples.sort(key=lambda sample: sample[0])
    if half_turn:
        samples += [(40, se3.IDENTITY), (50, (1.0, 2.0, 3.0, *HALF))]
    stamps, poses = [stamp for stamp, _ in samples], [pose for _, pose in samples]
    history = history_of(stamps, poses)
    reach = max(math.hypot(*pose[:3]) for pose in poses)
    for first, last in ((stamps[0], stamps[-1]), (stamps[0] + 2, stamps[-1] - 2)):
        if first > last:
            continue
        track = history.track(first, last)
        asked = np.arange(first, last + 1)
        found = track.at(asked)
        assert found.shape == (7, len(asked))
        for stamp, pose in zip(asked.tolist(), found.T.tolist(), strict=True):
            # Of rotations as near as 2e-8, the last bit decides whether they differ.
            assert_same_rotation(pose[3:], history.sample(stamp)[3:], 2e-8)
            assert pose[:3] == pytest.approx(history.sample(stamp)[:3], abs=1e-14 * reach)
        assert (track.at(asked.reshape(1, -1, 1)) == found.reshape(7, 1, -1, 1)).all()
    assert history.track(first, stamps[-1]).reach <= reach * (1.0 + 1e-15)
    whole = InterpolatedTrack(np.array(stamps), np.array(poses))
    assert whole.reach == pytest.approx(reach)


def test_half_turns_and_the_tiniest_are_those_of_single_poses():
    rng = np.random.default_rng(4)
    poses = []
    for a, axis in zip(random_poses(rng, 20).tolist(), rng.normal(size=(20, 3)), strict=True):
        half = (*(axis / np.linalg.norm(axis)).tolist(), 0.0)
        poses += [a, (*a[:3], *so3.multiply(a[3:], half))]
    stamps = list(range(0, 400, 10))
    history = history_of(stamps, poses)
    asked = np.array([[stamp + 3, stamp + 8] for stamp in stamps[:-1]])
    found = history.track(0, 390).at(asked)
    for index, stamp in np.ndenumerate(asked):
        assert_same_pose(found[(slice(None), *index)].tolist(), history.sample(int(stamp)))
    # The cosine of this rotation is one, so it begins at its end.
    history = history_of([0, 10], [turned(0.0), turned(1e-8)])
    assert history.sample(5)[5] == history.track(0, 10).at(np.array([5]))[5] == 0.0


def test_times_between_nanoseconds_are_added_to_stamps():
    knots, poses = [10, 11, 15, 25], [turned(angle, 100.0 * angle) for angle in (0, 1, 2, 2.5)]
    track = InterpolatedTrack(np.array(knots), np.array(poses))
    stamps, since = np.array([10, 11, 12, 24, 25]), np.array([0.5, 0.25, 2.0, 0.5, 0.0])
    angles = [0.5, 1.0625, 1.75, 2.475, 2.5]
    found = track.at(stamps, since).T.tolist()
    for pose, angle in zip(found, angles, strict=True):
        assert_same_pose(pose, turned(angle, 100.0 * angle), 1e-13, reach=250.0)
    # Several times after each stamp, also near half a turn.
    for last in (turned(1.0, 2.0), (2.0, 0.0, 0.0, *HALF)):
        two = InterpolatedTrack(np.array([10, 20]), np.array([se3.IDENTITY, last]))
        grid = two.at(np.array([[10], [12]]), np.array([[0.0, 1.5, 4.0]]))
        assert grid.shape == (7, 2, 3)
        for row, stamp in enumerate((0, 2)):
            for column, after in enumerate((0.0, 1.5, 4.0)):
                ratio = (stamp + after) / 10
                assert_same_pose(grid[:, row, column].tolist(), se3.interpolate(
                    se3.IDENTITY, last, ratio), 1e-13)


def test_reach_and_motion_by_hand():
    track = InterpolatedTrack(np.array([10, 20, 21, 40]), np.array([
        turned(0.0, 3.0, 4.0, 12.0), turned(0.5, 3.0, 4.0, 14.0), turned(0.6, 3.0, -5.0, 14.0),
        tuple(-value for value in turned(0.8, -3.0, 5.0, -14.0))]))
    assert track.reach == pytest.approx(math.sqrt(3 ** 2 + 5 ** 2 + 14 ** 2))
    for knots, angle, distance in (
            ([10, 20], 0.5, 2.0), ([10, 12, 20], 0.4, 1.6), ([10, 13, 16, 19], 0.15, 0.6),
            ([20, 21], 0.1, 9.0), ([10, 20, 21, 40], 0.5, 9.0), ([21, 40], 0.2, 0.0),
            ([22, 23], 0.2 / 19, 0.0), ([12, 20, 21, 30], 0.4, 9.0)):
        assert track.motion(np.array(knots)) == pytest.approx((angle, distance), abs=1e-7)
    assert [type(value) for value in track.motion(np.array([10, 20]))] == [float, float]
    # A step along all three axes; and rotations whose rounding is above one.
    straight = InterpolatedTrack(np.array([0, 10]), np.array([
        (1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0 + 1e-15), (3.0, 4.0, 7.0, 0.0, 0.0, 0.0, 1.0 + 1e-15)]))
    assert straight.motion(np.array([0, 10])) == (0.0, pytest.approx(7.0))
    # About each axis.
    for axis in range(3):
        quaternion = [0.0, 0.0, 0.0, math.cos(0.2)]
        quaternion[axis] = math.sin(0.2)
        track = InterpolatedTrack(np.array([0, 10]), np.array([
            (0, 0, 0, *quaternion), se3.IDENTITY]))
        assert track.motion(np.array([0, 10])) == pytest.approx((0.4, 0.0))
        track = InterpolatedTrack(np.array([0, 10]), np.array([(0, 0, 0, *quaternion)] * 2))
        assert track.motion(np.array([0, 10])) == pytest.approx((0.0, 0.0), abs=1e-7)


def test_edge_that_never_moves_has_no_knots():
    track = ConstantTrack((1.0, 2.0, -2.0, 0.6, 0.0, 0.0, 0.8))
    assert (track.knots.dtype, track.knots.shape) == (np.int64, (0,))
    assert (track.reach, track.motion(np.array([1, 2]))) == (3.0, (0.0, 0.0))
    for shape in ((), (4,), (2, 3)):
        found = track.at(np.zeros(shape, dtype=np.int64), np.zeros(shape))
        assert found.shape == (7, *(1 for _ in shape))
        assert found.ravel().tolist() == [1.0, 2.0, -2.0, 0.6, 0.0, 0.0, 0.8]


def test_held_track_stands_still_after_its_end():
    # The square of this rotation is just below one: it is interpolated with itself.
    last = (2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0 - 1e-16)
    inner = InterpolatedTrack(np.array([0, 10, 20]), np.array([se3.IDENTITY] * 2 + [last]))
    held = HeldTrack(inner)
    assert (held.knots.tolist(), held.reach) == ([0, 10, 20], 2.0)
    stamps = np.array([10, 15, 19, 20, 21, 90])
    assert held.at(stamps)[0].tolist() == pytest.approx([0.0, 1.0, 1.8, 2.0, 2.0, 2.0])
    found = held.at(stamps, np.array([1.0, 2.5, 0.5, 1e8, 1e8, 0.0]))
    assert found[0].tolist() == pytest.approx([0.2, 1.5, 1.9, 2.0, 2.0, 2.0])
    assert found[6].tolist() == pytest.approx([1.0] * 6)
    assert held.motion(np.array([10, 15, 25])) == pytest.approx((0.0, 1.0), abs=1e-7)
    assert held.motion(np.array([18, 20, 90])) == pytest.approx((0.0, 0.4), abs=1e-7)
    assert held.motion(np.array([30, 90])) == pytest.approx((0.0, 0.0), abs=1e-7)


def test_poses_one_by_one_are_asked_for_only_between_samples():
    asked = []

    def between(index, stamp):
        asked.append((index, stamp))
        return turned(0.0, 100.0 * index + stamp)

    poses = np.array([turned(0.0, number) for number in range(3)])
    track = OneByOneTrack(np.array([10, 20, 30]), poses, between)
    assert (track.knots.tolist(), track.reach, track.motion(np.array([10, 20]))) == (
        [10, 20, 30], math.inf, (math.inf, math.inf))
    assert track.at(np.array([10, 11, 19, 20, 25, 30, 31]))[0].tolist() == [
        0.0, 11.0, 19.0, 1.0, 125.0, 2.0, 2.0]
    assert asked == [(0, 11), (0, 19), (1, 25)]
    found = track.at(np.array([10, 25]), np.array([[0.5], [1.25], [3.0]]))
    assert found.shape == (7, 3, 2)
    assert found[0].tolist() == [[0.0, 125.0], [11.0, 126.0], [13.0, 128.0]]
    assert found[6].tolist() == [[1.0] * 2] * 3


# --- interpolations


class Noted(Interpolation):
    """Holds the older sample, and notes what it was asked."""

    def __init__(self):
        self.asked = []

    def between(self, samples, index, stamp):
        self.asked.append((samples.stamps.tolist(), index, stamp))
        return samples.pose(index)


def test_interpolation_of_a_user_sees_two_more_samples_on_either_side():
    policy = Noted()
    history = history_of(range(0, 100, 10), [turned(0.0, number) for number in range(10)])
    history.interpolate_by(policy)
    for first, last, stamps in ((35, 42, range(10, 80, 10)), (40, 41, range(20, 80, 10)),
                                (3, 4, range(0, 40, 10)), (89, 90, range(60, 100, 10)),
                                (0, 90, range(0, 100, 10))):
        track = history.track(first, last)
        assert type(track) is OneByOneTrack
        assert track.knots.tolist() == [
            stamp for stamp in range(0, 100, 10) if first - 10 < stamp < last + 10 or (
                stamp == last + 10)]
        policy.asked.clear()
        for stamp in range(first, last + 1):
            assert track.at(np.array([stamp]))[0].tolist() == [stamp // 10]
        assert policy.asked == [(list(stamps), stamp // 10 - stamps[0] // 10, stamp)
                                for stamp in range(first, last + 1) if stamp % 10]


def test_interpolation_does_nothing_that_it_need_not():
    policy, other = Noted(), Noted()
    assert policy.copy() is policy
    assert policy.followed_by(other) is other
    assert (policy.clear(), policy.forget(), policy.name, policy.holds_for) == (
        None, None, '', 0)
    assert Linear.name == 'linear'
    with pytest.raises(NotImplementedError, match=r'^Interpolation must define between\(\)$'):
        Interpolation().between(history_of([1], [turned(0.0)]), 0, 1)


def test_linear_interpolation_is_that_of_a_lookup():
    history = history_of([10, 20, 40], [turned(0.0), turned(1.0, 2.0), turned(1.4, 3.0)])
    for stamp, index, expected in ((11, 0, turned(0.1, 0.2)), (19, 0, turned(0.9, 1.8)),
                                   (35, 1, turned(1.3, 2.75))):
        assert_same_pose(LINEAR.between(history, index, stamp), expected)
        assert_same_pose(history.sample(stamp), expected)
    assert LINEAR.track(history, 12, 22).knots.tolist() == [10, 20, 40]


def test_subclass_of_linear_is_linear_only_without_poses_of_its_own():
    class Doubled(Linear):

        def between(self, samples, index, stamp):
            return tuple(2.0 * value for value in super().between(samples, index, stamp)[:3]) + (
                0.0, 0.0, 0.0, 1.0)

    class Held(Linear):
        holds_for = 5

    history = history_of([10, 20], [turned(0.0), turned(0.0, 2.0)])
    for policy, linear, x in ((LINEAR, True, 1.0), (Held(), True, 1.0), (Doubled(), False, 2.0)):
        assert is_linear(policy) is linear
        history.interpolate_by(policy)
        assert history.sample(15)[0] == x
        track = history.track(10, 20)
        assert type(track) is (InterpolatedTrack if linear else OneByOneTrack)
        assert track.at(np.array([15]))[0].tolist() == [x]


@pytest.mark.parametrize(('returned', 'text'), [
    (ZeroDivisionError('no'), r"raised ZeroDivisionError\('no'\)$"),
    (None, 'returned no pose: None is not a pose'),
    ((1.0,) * 7, r'returned \(1.0, .*\), which is not finite, or whose quaternion does not'),
    ((math.nan, 0, 0, 0, 0, 0, 1), r'returned \(nan, .*, which is not finite')])
def test_interpolation_of_a_user_is_named_where_it_goes_wrong(returned, text):
    class Wrong(Interpolation):

        def between(self, samples, index, stamp):
            if isinstance(returned, Exception):
                raise returned
            return returned

    history = history_of([10, 20], [turned(0.0), turned(0.0, 2.0)])
    with pytest.raises(InvalidArgumentException, match=(
            f"^Wrong.between, the interpolation of the edge above 'child', {text}")):
        Wrong().pose(history, 0, 15)


def test_what_is_no_interpolation_is_refused():
    for given_object in (LINEAR, HoldNewest(0), HoldNewest(5)):
        assert checked_interpolation(given_object) is given_object
    for given_object, text in (
            (Linear, r"^<class '.*Linear'> is not an Interpolation: pass an object, not the"),
            ('linear', "^'linear' is not an Interpolation$"), (None, 'is not an Interpolation$')):
        with pytest.raises(InvalidArgumentException, match=text):
            checked_interpolation(given_object)
    for span in (-1, 1.5, True, None):
        policy = Noted()
        policy.holds_for = span
        with pytest.raises(InvalidArgumentException, match=(
                f'^holds_for of Noted is {span}, and must be integer nanoseconds, at least 0$')):
            checked_interpolation(policy)


# --- static edges


def test_static_edge_in_full():
    pose, other = turned(0.3, 1.0), turned(0.7, 2.0)
    edge = StaticHistory('child', 'parent', pose)
    assert (edge.child, edge.parent, edge.pose, edge.authority, len(edge)) == (
        'child', 'parent', pose, '', 1)
    assert (edge.oldest_stamp, edge.newest_stamp, edge.latest_stamp) == (0, 0, 0)
    assert (edge.described_as, edge.is_static, edge.takes_samples, edge.fixed_parent) == (
        'static', True, True, True)
    for stamp in (BEGINNING, -1, 0, 5, FOREVER - 1):
        assert edge.sample(stamp) == pose
        assert edge.parent_at(stamp) == 'parent'
        assert edge.possible_parents(stamp) == {'parent'}
        assert (edge.is_too_old(stamp), edge.next_stamp(stamp)) == (False, FOREVER)
        assert edge.append(stamp, b'') is False
        assert edge.continues('parent', stamp, pose)
        assert not edge.continues('other', stamp, pose)
        assert not edge.continues('parent', stamp, other)
    assert edge.neighbours(1, 2) == pose + pose
    assert list(edge.parents_between(5, 6)) == [('parent', BEGINNING, FOREVER)]
    assert (edge.has_named('parent'), edge.has_named('other')) == (True, False)
    assert edge.track(1, 2).at(np.array([7])).ravel().tolist() == list(pose)
    assert edge.twists(np.array([1, 2, 3])).tolist() == [[0.0] * 6] * 3
    edge.authority = 'broadcaster'
    twin = edge.copy()
    assert edge.insert(9, 'other', other) is True
    edge.clear()
    assert (edge.parent, edge.sample(0)) == ('other', other)
    assert (twin.child, twin.parent, twin.pose, twin.authority) == (
        'child', 'parent', pose, 'broadcaster')
    with pytest.raises(TypeError, match='StaticHistory has no truth value'):
        bool(edge)
    assert [moves(each) for each in (edge, None, history_of([1], [pose]))] == [
        False, False, True]
