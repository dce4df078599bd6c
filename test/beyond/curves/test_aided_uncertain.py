# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The covariance between two poses with a gyroscope, compared with draws; and its gaps."""

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import InvalidArgumentException, Pose, UNLIMITED
from tf_tree_py.core.geometry import so3

SECOND = 1_000_000_000
MS = 1_000_000
RATES = np.array([1.0, -2.0, 4.0])
POSES = Pose.from_xyz_rpy(x=1.0, yaw=0.5), Pose.from_xyz_rpy(x=2.0, y=1.0, roll=-0.8, yaw=2.0)
SIGMA = 1e-3 * np.array([1.0, 2.0, 0.5, 3.0, 1.0, 0.3])


def aided(poses, covariance=None, rates=RATES):
    buffer = BufferCore(UNLIMITED)
    for number, pose in enumerate(poses):
        buffer.insert('odom', 'base', number * SECOND, pose, covariance=covariance)
    stamps = np.arange(0, SECOND + 1, 5 * MS)
    buffer.aid('base', stamps, np.tile(rates, (len(stamps), 1)))
    return buffer


def shifted(pose, error):
    """Return a pose with an error in the convention of ``PoseWithCovariance``."""
    return Pose.from_parts(np.add(pose[:3], error[:3]),
                           so3.multiply(so3.exp(tuple(error[3:].tolist())), pose[3:]))


def errors_at(stamp, first, last):
    """Return the errors (N, 6) at a stamp in between, from the errors (N, 6) of both poses."""
    middle = aided(POSES).lookup_at('odom', 'base', stamp)
    found = []
    for one, other in zip(first, last, strict=True):
        pose = aided((shifted(POSES[0], one), shifted(POSES[1], other))).lookup_at(
            'odom', 'base', stamp)
        turned = so3.log(so3.multiply(pose[3:], so3.conjugate(middle[3:])))
        found.append((*np.subtract(pose[:3], middle[:3]), *turned))
    return np.array(found)


def sigma_points():
    """Return errors (12, 6) whose second moment is the covariance."""
    return np.concatenate([np.sqrt(6.0) * np.diag(SIGMA), -np.sqrt(6.0) * np.diag(SIGMA)])


@for_each(part=[0.1, 0.5, 0.8])
def test_covariance_of_independent_poses_is_interpolated_when_aided(part):
    stamp, none = round(part * SECOND), np.zeros((12, 6))
    said = aided(POSES, np.diag(SIGMA**2)).lookup_uncertain(
        'odom', 'base', stamp, independent=True)[1]
    both = [errors_at(stamp, sigma_points(), none), errors_at(stamp, none, sigma_points())]
    true = sum(errors.T @ errors / 12 for errors in both)
    np.testing.assert_allclose(said, true, atol=0.01 * SIGMA.min() * SIGMA.max())


@for_each(part=[0.1, 0.5, 0.8], sign=[1.0, -1.0])
def test_bound_holds_however_the_poses_are_correlated(part, sign):
    stamp = round(part * SECOND)
    bound = aided(POSES, np.diag(SIGMA**2)).lookup_uncertain('odom', 'base', stamp)[1]
    errors = errors_at(stamp, sigma_points(), sign * sigma_points())
    excess = np.linalg.eigvalsh(bound - errors.T @ errors / 12)
    assert excess.min() > -1e-3 * SIGMA.max()**2


def test_many_have_the_covariances_of_one():
    buffer = aided(POSES, np.diag(SIGMA**2))
    stamps = [0, 300 * MS, 700 * MS, SECOND]
    many = buffer.lookup_uncertain_many('odom', 'base', stamps, independent=True)[1]
    for stamp, covariance in zip(stamps, many, strict=True):
        np.testing.assert_allclose(buffer.lookup_uncertain(
            'odom', 'base', stamp, independent=True)[1], covariance, atol=1e-15)


TWO = ((0.2, 0.4), (0.6, 0.85))


@for_each(part=[0.1, 0.3, 0.5, 0.7, 0.9], hole=[
    ((0.25, 0.65),), ((0.0, 0.4),), ((0.6, 1.0),), TWO])
def test_covariance_of_independent_poses_is_that_of_the_bridge(part, hole):
    stamp, none = round(part * MS_50), np.zeros((12, 6))
    middle = holed(POSES, hole).lookup_at('odom', 'base', stamp)
    both = [holed_errors(stamp, hole, middle, sigma_points(), none),
            holed_errors(stamp, hole, middle, none, sigma_points())]
    said = holed(POSES, hole, np.diag(SIGMA**2)).lookup_uncertain(
        'odom', 'base', stamp, independent=True)[1]
    true = sum(errors.T @ errors / 12 for errors in both)
    np.testing.assert_allclose(said, true, atol=0.02 * SIGMA.min() * SIGMA.max())


@for_each(part=[0.1, 0.3, 0.5, 0.7, 0.9], sign=[1.0, -1.0], hole=[((0.25, 0.65),), TWO])
def test_bound_holds_in_a_gap_however_the_poses_are_correlated(part, sign, hole):
    stamp = round(part * MS_50)
    middle = holed(POSES, hole).lookup_at('odom', 'base', stamp)
    buffer = holed(POSES, hole, np.diag(SIGMA**2))
    bound = buffer.lookup_uncertain('odom', 'base', stamp)[1]
    errors = holed_errors(stamp, hole, middle, sigma_points(), sign * sigma_points())
    assert np.linalg.eigvalsh(bound - errors.T @ errors / 12).min() > -1e-3 * SIGMA.max()**2
    many = buffer.lookup_uncertain_many('odom', 'base', [0, stamp, MS_50])[1]
    np.testing.assert_allclose(many[1], bound, atol=1e-15)
    np.testing.assert_allclose(many[[0, 2]], [np.diag(SIGMA**2)] * 2, atol=1e-15)


MS_50 = 50 * MS


def holed(poses, holes, covariance=None):
    """Return two poses that are 50 ms apart, and a gyroscope with holes in between."""
    buffer = BufferCore(UNLIMITED)
    for number, pose in enumerate(poses):
        buffer.insert('odom', 'base', number * MS_50, pose, covariance=covariance)
    stamps = np.arange(-20 * MS, 70 * MS, MS // 2)
    for begin, end in np.multiply(holes, MS_50):
        stamps = stamps[(stamps <= begin) | (stamps >= end)]
    buffer.aid('base', stamps, np.tile(10.0 * RATES, (len(stamps), 1)))
    return buffer


def holed_errors(stamp, holes, middle, first, last):
    """Return the errors (N, 6) at a stamp in between, from the errors (N, 6) of both poses."""
    found = []
    for one, other in zip(first, last, strict=True):
        pose = holed((shifted(POSES[0], one), shifted(POSES[1], other)), holes).lookup_at(
            'odom', 'base', stamp)
        turned = so3.log(so3.multiply(pose[3:], so3.conjugate(middle[3:])))
        found.append((*np.subtract(pose[:3], middle[:3]), *turned))
    return np.array(found)


# --- limits

def with_hole(rates=3.0, **limits):
    """Return an edge without rotation in its poses, aided with a gap from 1.2 s to 1.8 s."""
    buffer = BufferCore(UNLIMITED)
    for stamp in range(4):
        buffer.insert('odom', 'base', stamp * SECOND, Pose())
    stamps = np.concatenate([np.arange(0, 1201, 5), np.arange(1800, 3001, 5)]) * MS
    z = np.broadcast_to(rates, stamps.shape)
    buffer.aid('base', stamps, np.stack([0 * z, 0 * z, z], axis=1), **limits)
    return buffer


def yaw_at(buffer, stamp):
    return buffer.lookup_at('odom', 'base', stamp * MS).as_rpy()[2]


def test_largest_gap_can_be_set():
    """In a gap it turns back evenly what it turned before and after; else by the bias."""
    assert yaw_at(with_hole(), 1200) == pytest.approx(0.6) == -yaw_at(with_hole(), 1800)
    assert yaw_at(with_hole(), 1400) == pytest.approx(0.2)
    assert yaw_at(with_hole(max_gap=700 * MS), 1200) == pytest.approx(0.0)
    assert with_hole(max_gap=2 * MS).lookup_at('odom', 'base', 500 * MS) == Pose()
    for wrong in ({'max_gap': 0}, {'max_gap': 0.5}, {'saturation': 0.0},
                  {'saturation': float('nan')}):
        with pytest.raises(InvalidArgumentException, match='positive'):
            with_hole(**wrong)


def test_saturated_gyroscope_is_not_believed():
    """The sample before the one at 250 ms and the one after it are believed."""
    rates = np.where(np.arange(482) == 50, 9.0, 0.0)
    clipped, whole = with_hole(rates, saturation=9.0), with_hole(rates)
    assert [yaw_at(clipped, stamp) for stamp in (240, 250, 260)] == pytest.approx([0.0] * 3)
    assert yaw_at(whole, 260) - yaw_at(whole, 240) == pytest.approx(0.045 * (1.0 - 0.02))
    late = 2_500 * MS
    assert clipped.lookup_at('odom', 'base', late) == whole.lookup_at('odom', 'base', late)


def test_first_rate_may_be_slow_and_jitter_is_no_hole():
    buffer, rng = BufferCore(UNLIMITED), np.random.default_rng(2)
    for stamp in range(4):
        buffer.insert('odom', 'base', stamp * SECOND, Pose())
    stamps = np.cumsum(rng.uniform(2 * MS, 8 * MS, 900)).astype(np.int64)
    buffer.aid('base', stamps, np.stack([0 * stamps, 0 * stamps, np.sin(stamps / 1e8)], axis=1))
    assert buffer.lookup_at('odom', 'base', 1_500 * MS) != Pose()


def test_prediction_has_the_covariance_of_the_aided_edge_that_it_looks_up():
    """Only the arm is predicted; the base has the same covariance as in a lookup."""
    buffer = aided(POSES, np.diag(SIGMA**2))
    for stamp in range(0, 401 * MS, 20 * MS):
        buffer.insert('base', 'arm', stamp, Pose())
    ahead = buffer.predict('odom', 'arm', 500 * MS, SECOND)
    known = buffer.lookup_uncertain('odom', 'base', 500 * MS)[1]
    assert ahead.beyond == 100 * MS
    np.testing.assert_allclose(ahead.covariance, known, rtol=1e-6, atol=1e-15)
