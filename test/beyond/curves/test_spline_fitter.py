# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A growing spline: as good as one that is fitted at once, and final where it is frozen."""

from memory import bytes_of
import numpy as np
import pytest
from strategies import waving_poses
from tf_tree_py import screws, Spline, SplineFitter
from tf_tree_py.core import InvalidArgumentException, Pose
from tf_tree_py.core.geometry import se3, so3

START = 1_700_000_000_000_000_000
PERIOD = 5_000_000


def wave(stamps):
    return waving_poses((np.asarray(stamps) - START) * 1e-9)


STAMPS = START + np.arange(400) * PERIOD


def errors(spline, stamps):
    return [error.max() for error in se3.distance_many(wave(stamps), spline.poses(stamps))]


@pytest.mark.parametrize('on_se3', [False, True])
@pytest.mark.parametrize('cuts', [[], [399], [1, 2, 3, 50, 51, 53, 250, 395, 399],
                                  range(100, 140)])
def test_piece_by_piece_it_is_as_good_as_at_once(on_se3, cuts):
    fitter = SplineFitter(50.0, on_se3=on_se3)
    for part in np.split(STAMPS, cuts):
        spline = fitter.add(part, wave(part))
    assert (spline.oldest, spline.latest) == (STAMPS[0], STAMPS[-1])
    # The knots are at other stamps, because the whole fit slightly adjusts their period.
    asked = np.random.default_rng(1).integers(STAMPS[0], STAMPS[-1], 3000)
    whole = errors(Spline.fit(STAMPS, wave(STAMPS), 50.0, on_se3=on_se3), asked)
    assert np.all(np.array(errors(spline, asked)) < 1.5 * np.array(whole))


@pytest.mark.parametrize('on_se3', [False, True])
@pytest.mark.parametrize('rate_rad_s', [0.3, 3.0])
def test_one_pose_at_a_time_is_as_good_as_a_fit_of_all(on_se3, rate_rad_s):
    """One pose is a linear step, two are a fit; on SPLIT, positions are linear."""
    single, pairs = (SplineFitter(10.0, on_se3=on_se3) for _ in range(2))
    stamps = START + np.arange(160) * 2 * PERIOD
    true = screws.exp_many(((stamps - START) * 1e-9)[:, None] * [
        1.0, 0.5, 0.0, 0.0, 0.3 * rate_rad_s, rate_rad_s])
    measured = true + np.random.default_rng(5).normal(0.0, 1e-3, true.shape)
    errors_m_rad = []
    for first in range(0, len(stamps), 2):
        one, both, newest = (slice(first, first + 1), slice(first, first + 2), first + 1)
        single.add(stamps[one], measured[one])
        splines = (single.add(stamps[newest:newest + 1], measured[newest:newest + 1]),
                   pairs.add(stamps[both], measured[both]))
        errors_m_rad.append([
            se3.distance_many(spline.poses(stamps[both]), true[both]) for spline in splines])
    rms = np.sqrt(np.mean(np.square(errors_m_rad[10:]), axis=(0, 3)))
    assert np.all(rms[0] < np.array([2.0 if on_se3 else 1.001, 1.03]) * rms[1])
    final = stamps[single.frozen_until > stamps]
    assert single.frozen_until == pairs.frozen_until > STAMPS[150]
    assert np.max(se3.distance_many(
        single.spline.poses(final), pairs.spline.poses(final))) < 1e-5


def test_what_is_frozen_never_changes():
    fitter, asked = SplineFitter(50.0), {}
    for stamp in STAMPS[:250]:
        spline = fitter.add([stamp], wave([stamp]))
        for before, pose in asked.items():
            assert spline.pose(before) == pose
        asked |= {number: spline.pose(number) for number in range(
            STAMPS[0], fitter.frozen_until, 7_777_777) if number not in asked}
    assert fitter.frozen_until > STAMPS[250] - 250_000_000
    assert len(asked) > 100


def test_late_pose_counts_until_its_time_is_frozen():
    fitter = SplineFitter(50.0)
    on_time = np.delete(STAMPS, np.s_[380:385])
    fitter.add(on_time, wave(on_time))
    late = fitter.add(STAMPS[380:385], wave(STAMPS[380:385]))
    assert errors(late, STAMPS) < [1e-5, 1e-5]
    with pytest.raises(InvalidArgumentException, match='is too old: the spline is final'):
        fitter.add(STAMPS[100:101], wave(STAMPS[100:101]))
    assert fitter.spline is late


def test_only_the_window_is_kept():
    fitter = SplineFitter(50.0, cache_time=500_000_000)
    for part in np.split(STAMPS, 40):
        spline = fitter.add(part, wave(part))
        assert len(spline) < 25 + 8
    assert spline.latest == STAMPS[-1]
    assert 500_000_000 <= spline.latest - spline.oldest < 520_000_000
    assert errors(spline, STAMPS[spline.oldest <= STAMPS]) < [1e-5, 1e-5]
    assert bytes_of(fitter) < 8_000


def test_after_a_long_silence_it_begins_anew():
    fitter = SplineFitter(50.0, cache_time=10**9)
    fitter.add(STAMPS, wave(STAMPS))
    later = STAMPS[:5] + 20 * 10**9
    spline = fitter.add(later, wave(later))
    assert (spline.oldest, len(spline)) == (later[0], 4)
    with pytest.raises(InvalidArgumentException, match='too long for one spline'):
        SplineFitter(50.0).add([-2**63, 2**63 - 1], [Pose()] * 2)


def test_bad_pose_leaves_it_as_it_was():
    fitter = SplineFitter(50.0)
    before = fitter.add(STAMPS[:50], wave(STAMPS[:50]))
    with pytest.raises(InvalidArgumentException, match='is not a pose'):
        fitter.add(STAMPS[50:52], [Pose(), Pose(float('nan'))])
    assert fitter.spline is before
    assert errors(fitter.add(STAMPS[50:80], wave(STAMPS[50:80])), STAMPS[:80]) < [1e-5, 1e-5]


def test_gap_is_bridged_evenly():
    fitter, twist = SplineFitter(50.0), np.array([1.0, 0.5, 0.0, 0.0, 0.0, 2.0])
    for part in (STAMPS[:50], STAMPS[150:151], STAMPS[151:300]):
        poses = screws.exp_many(((part - START) * 1e-9)[:, None] * [1.0, 0.5, 0, 0, 0, 0])
        poses[:, 3:] = so3.exp_many(((part - START) * 1e-9)[:, None] * twist[3:])
        spline = fitter.add(part, poses)
    for stamp in range(STAMPS[0], STAMPS[299], 3_333_333):
        assert spline.twist(stamp)[3:] == pytest.approx(twist[3:], abs=1e-4)
        assert np.linalg.norm(spline.twist(stamp)[:3]) == pytest.approx(1.25**0.5, abs=1e-4)


def test_standing_still_stays_still():
    fitter, pose = SplineFitter(50.0), Pose.from_xyz_rpy(1.0, 2.0, 3.0, 0.4, 0.5, 3.0)
    for stamp in STAMPS[:100]:
        spline = fitter.add([stamp], [pose])
    assert np.abs(spline.twists(STAMPS[:100])).max() < 1e-6


def test_too_long_a_stretch_for_its_knots_is_refused_at_once():
    fitter = SplineFitter(1000.0, cache_time=2**62)
    fitter.add([0], [Pose()])
    with pytest.raises(InvalidArgumentException, match='knots'):
        fitter.add([10**17], [Pose()])
    assert fitter.add([10**6], [Pose()]).latest == 10**6
