# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Splines alone: their own samples fit them, and their derivatives match their poses."""

import math
import pickle

from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import assert_same_pose, waving_poses
from tf_tree_py import screws, Spline
from tf_tree_py.beyond.curves.spline_segment import SE3, SPLIT
from tf_tree_py.core import InvalidArgumentException, Pose
from tf_tree_py.core.geometry import se3, so3

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
on_both = pytest.mark.parametrize('group', [SPLIT, SE3], ids=['split', 'se3'])


def wave(stamps):
    return waving_poses((np.asarray(stamps) - START) * 1e-9)


def every(rate_hz, seconds=1.0):
    return START + np.arange(round(seconds * rate_hz) + 1) * (SECOND // rate_hz)


def random_spline(seed, group, turn=0.3, pieces=6):
    """Return a spline with this rotation between neighbouring knots, and as much translation."""
    rng = np.random.default_rng(seed)
    knots = [screws.exp(tuple(rng.normal(size=6)))]
    for _ in range(pieces + 2):
        knots.append(se3.compose(knots[-1], screws.exp(tuple(turn * rng.normal(size=6)))))
    period = 20_000_000
    return Spline(START, period, np.array(knots), START + pieces * period, group)


def between(rng, spline, count):
    return rng.integers(spline.oldest, spline.latest, count, endpoint=True)


# --- the curve


@on_both
def test_a_spline_that_is_sampled_comes_back(group):
    spline = random_spline(1, group)
    stamps = np.linspace(spline.oldest, spline.latest, 200).astype(np.int64)
    again = Spline.fit(stamps, spline.poses(stamps), 50.0, on_se3=group is SE3)
    assert again.knot_period == spline.knot_period
    moved, turned = se3.distance_many(spline.knots, again.knots)
    # Its knots are as uneven as possible, and the fit slightly prefers even ones.
    assert moved.max() < 2e-4 and turned.max() < 2e-4


@on_both
@given(seed=st.integers(0, 2**32), turn=st.sampled_from([0.0, 1e-9, 1e-4, 0.3, 1.0]))
def test_one_stamp_is_answered_as_among_many(group, seed, turn):
    spline = random_spline(seed, group, turn)
    stamps = between(np.random.default_rng(seed), spline, 9)
    stamps[:2] = spline.oldest, spline.latest
    many = spline.poses(stamps), spline.twists(stamps), spline.accelerations(stamps)
    for stamp, pose, twist, acceleration in zip(stamps.tolist(), *many, strict=True):
        assert_same_pose(spline.pose(stamp), pose, reach=10.0)
        assert spline.twist(stamp) == pytest.approx(twist, rel=1e-9, abs=1e-9)
        assert spline.acceleration(stamp) == pytest.approx(acceleration, rel=1e-9, abs=1e-6)


@on_both
@given(seed=st.integers(0, 2**32))
def test_twist_and_acceleration_are_the_derivatives_of_the_poses(group, seed):
    spline = random_spline(seed, group)
    step = 10_000
    # At least a step away from a knot, because the third derivative jumps there.
    rng = np.random.default_rng(seed)
    stamps = spline.begin + rng.integers(0, spline.pieces, 30) * spline.knot_period + rng.integers(
        step, spline.knot_period - step, 30)
    before, now, after = (spline.poses(stamps + shift) for shift in (-step, 0, step))
    back, seconds = so3.conjugate_many(now[:, 3:]), step * 1e-9
    twists, accelerations = spline.twists(stamps), spline.accelerations(stamps)

    speed = (after[:, :3] - before[:, :3]) / (2.0 * seconds)
    turning = so3.log_many(so3.multiply_many(
        so3.conjugate_many(before[:, 3:]), after[:, 3:])) / (2.0 * seconds)
    np.testing.assert_allclose(twists[:, :3], so3.rotate_many(back, speed), atol=2e-4)
    np.testing.assert_allclose(twists[:, 3:], turning, atol=2e-4)

    # From the twists, because the second difference of poses loses half of the digits.
    world = [so3.rotate_many(spline.poses(stamps + shift)[:, 3:],
                             spline.twists(stamps + shift)[:, :3]) for shift in (-step, step)]
    turns = [spline.twists(stamps + shift)[:, 3:] for shift in (-step, step)]
    np.testing.assert_allclose(
        accelerations[:, :3], so3.rotate_many(back, np.subtract(*world[::-1]) / (2.0 * seconds)),
        atol=1e-2)
    np.testing.assert_allclose(
        accelerations[:, 3:], np.subtract(*turns[::-1]) / (2.0 * seconds), atol=1e-2)


@on_both
def test_acceleration_has_no_jump_between_two_pieces(group):
    spline = random_spline(2, group)
    for number in range(1, spline.pieces):
        knot = spline.begin + number * spline.knot_period
        one, other = spline.accelerations([knot - 1, knot])
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-4)


# --- fitting


@on_both
def test_error_falls_with_the_fourth_power_of_the_rate(group):
    asked = START + np.random.default_rng(3).integers(SECOND // 4, 3 * SECOND // 4, 2000)
    worst = []
    for rate in (50, 100, 200):
        stamps = every(rate)
        found = Spline.fit(stamps, wave(stamps), rate, on_se3=group is SE3).poses(asked)
        worst.append([error.max() for error in se3.distance_many(wave(asked), found)])
    powers = np.log2(np.divide(worst[:-1], worst[1:]))
    expected = [4.0 if group is SPLIT else 3.5, 3.1]
    np.testing.assert_allclose(powers, [expected, expected], atol=0.2)


def test_fit_at_the_rate_of_the_poses_passes_through_them():
    stamps = every(50)
    moved, turned = se3.distance_many(wave(stamps), Spline.fit(
        stamps, wave(stamps), 50.0).poses(stamps))
    assert moved.max() < 1e-7 and turned.max() < 1e-7


def test_noise_is_averaged():
    rng, stamps = np.random.default_rng(4), every(1000)
    noise = screws.exp_many(rng.normal(0.0, 1e-3, (len(stamps), 6)))
    spline = Spline.fit(stamps, se3.compose_many(wave(stamps), noise), 50.0)
    moved, turned = se3.distance_many(wave(stamps), spline.poses(stamps))
    # Of 3 * 1001 numbers of noise, the fraction 53 knots / 1001 poses remains.
    expected = 1e-3 * math.sqrt(3.0 * 53 / 1001)
    assert np.sqrt(np.mean(moved**2)) == pytest.approx(expected, rel=0.15)
    assert np.sqrt(np.mean(turned**2)) == pytest.approx(expected, rel=0.15)


def test_constant_twist_stays_one_through_a_gap():
    stamps = np.concatenate([every(100)[:40], every(100)[60:]])
    twist = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    poses = screws.exp_many(((stamps - START) * 1e-9)[:, None] * twist)
    spline = Spline.fit(stamps, poses, 50.0, on_se3=True)
    for stamp in every(1000):
        assert spline.twist(int(stamp)) == pytest.approx(twist, abs=1e-5)


def test_order_and_signs_of_the_poses_do_not_matter():
    rng, stamps = np.random.default_rng(5), every(200)
    poses = wave(stamps)
    order = rng.permutation(len(stamps))
    mixed = poses[order]
    mixed[:, 3:] *= rng.choice([-3.0, 0.5], (len(stamps), 1))
    one, other = Spline.fit(stamps, poses, 50.0), Spline.fit(stamps[order], mixed, 50.0)
    moved, turned = se3.distance_many(one.knots, other.knots)
    assert moved.max() < 1e-9 and turned.max() < 1e-9


def test_several_turns_are_followed():
    stamps = every(200, 3.0)
    angles = 9.0 * (stamps - START) * 1e-9
    poses = np.zeros((len(stamps), 7))
    poses[:, 5:] = np.stack([np.sin(angles / 2.0), np.cos(angles / 2.0)], 1)
    spline = Spline.fit(stamps, poses, 20.0)
    assert all(spline.twist(int(stamp))[5] == pytest.approx(9.0, abs=1e-5)
               for stamp in stamps[::50])


def test_too_few_knots_for_what_the_poses_turn_are_refused():
    stamps = every(1000)
    poses = np.zeros((len(stamps), 7))
    angles = 200.0 * (stamps - START) * 1e-9
    poses[:, 5:] = np.stack([np.sin(angles / 2.0), np.cos(angles / 2.0)], 1)
    with pytest.raises(InvalidArgumentException, match='half a turn or more between two knots'):
        Spline.fit(stamps, poses, 50.0)
    assert Spline.fit(stamps, poses, 200.0).twist(START)[5] == pytest.approx(200.0, abs=1e-3)


def test_what_was_fitted_cannot_be_changed():
    spline = Spline.fit(every(50), wave(every(50)), 20.0)
    with pytest.raises(ValueError, match='read-only'):
        spline.knots[0] = 0.0


@pytest.mark.parametrize(('stamps', 'knots'), [([5], 4), ([5, 5, 5], 4), ([5, 6], 4),
                                               ([5, 10**9 + 5], 4), ([-2**62, -1], 4)])
def test_few_poses_make_a_spline_too(stamps, knots):
    pose = Pose.from_xyz_rpy(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    span = max(stamps) - min(stamps)
    spline = Spline.fit(stamps, [pose] * len(stamps), 1e9 / max(span, 1))
    assert len(spline) == knots
    for stamp in (spline.oldest, (spline.oldest + spline.latest) // 2, spline.latest):
        assert_same_pose(spline.pose(stamp), pose, tolerance=1e-9)


@pytest.mark.parametrize(('given', 'match'), [
    ({'knot_rate_hz': 0.0}, 'knot_rate_hz 0.0'),
    ({'knot_rate_hz': math.nan}, 'knot_rate_hz nan'),
    ({'knot_rate_hz': 'fast'}, "knot_rate_hz 'fast'"),
    ({'knot_rate_hz': 10**400}, 'knot_rate_hz 10{400}: .* from 2e-10 to 1e9$'),
    ({'knot_rate_hz': 1e-300}, 'knot_rate_hz 1e-300'),
    ({'knot_rate_hz': 300.0}, 'knot_rate_hz below 100'),
    ({'stamps': []}, 'not 0 stamps and 101 poses'),
    ({'stamps': [], 'poses': []}, 'not 0 stamps and 0 poses'),
    ({'stamps': [0.5] * 101}, 'integer nanoseconds'),
    ({'stamps': [-2**63] * 50 + [2**63 - 1] * 51}, 'too long for one spline'),
    ({'poses': np.zeros((101, 6))}, r'\(101, 6\)'),
    ({'poses': np.zeros((101, 7))}, r'poses\[0\] is not a pose'),
    ({'poses': np.full((101, 7), np.inf)}, r'poses\[0\] is not a pose'),
])
def test_bad_input_is_told(given, match):
    good = {'stamps': every(100), 'poses': wave(every(100)), 'knot_rate_hz': 20.0}
    with pytest.raises(InvalidArgumentException, match=match):
        Spline.fit(**(good | given))


def test_outside_there_is_nothing():
    spline = random_spline(6, SPLIT)
    for stamp in (spline.oldest - 1, spline.latest + 1):
        for ask in (spline.pose, spline.twist, spline.acceleration):
            with pytest.raises(InvalidArgumentException, match='is outside the spline'):
                ask(stamp)
        with pytest.raises(InvalidArgumentException, match='is outside the spline'):
            spline.twists([spline.oldest, stamp])


@on_both
def test_spline_can_be_pickled(group):
    spline = random_spline(7, group)
    twin = pickle.loads(pickle.dumps(spline))
    assert twin.pose(START + 12345) == spline.pose(START + 12345)
    assert repr(twin) == repr(spline) and twin.twist(START) == spline.twist(START)
