# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The noise of an edge that is learnt from its samples, and lookups that use it."""

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ExtrapolationException,
    Interpolation,
    InvalidArgumentException,
    LookupException,
    Pose,
)
from tf_tree_py.core.geometry import so3
from turning_robot import turning

SECOND, MS = 1_000_000_000, 1_000_000
# Standard deviations, in the axes of the child.
DEVIATIONS = np.array([0.002, 0.004, 0.001, 0.003, 0.001, 0.002])


def noisy(pose, rng, deviations=DEVIATIONS):
    """Return a pose with noise in its own axes."""
    off = rng.normal(size=6) * deviations
    return pose @ Pose.from_parts(off[:3], so3.exp(tuple(off[3:].tolist())))


def driven(period, until=12 * SECOND, motion=turning, **noise):
    """Return a buffer with a robot that turns; its stamps tremble, and one in ten is lost."""
    rng, buffer = np.random.default_rng(1), BufferCore()
    for due in range(period, until, period):
        stamp = due + int(rng.normal(scale=0.1) * period)
        if rng.random() > 0.1:
            buffer.insert('odom', 'base', stamp, noisy(motion(stamp / SECOND), rng, **noise))
    return buffer


@pytest.mark.parametrize('period', [2 * MS, 10 * MS, 20 * MS, 100 * MS])
def test_noise_is_learnt_beside_a_motion(period):
    found, near = driven(period).edge_noise('base'), 0.4 if period == 100 * MS else 0.25
    np.testing.assert_allclose(np.sqrt(found.covariance.diagonal()), DEVIATIONS, rtol=near)
    assert 70 < found.trials <= 512
    units = np.sqrt(np.outer(*[found.covariance.diagonal()] * 2))
    assert np.abs(found.covariance / units - np.eye(6)).max() < 0.4


def test_correlated_noise_of_one_sample_keeps_its_correlation():
    rng, buffer = np.random.default_rng(2), BufferCore()
    for stamp in range(0, 12 * SECOND, 10 * MS):
        off = rng.normal(scale=0.01)
        buffer.insert('odom', 'base', stamp, Pose(x=off, y=0.5 * off))
    covariance = buffer.edge_noise('base').covariance
    assert covariance[0, 1] == pytest.approx(0.5 * covariance[0, 0], rel=0.1)


@pytest.mark.parametrize('motion', [turning, lambda seconds: Pose(x=3.0)])
def test_samples_without_noise_have_none(motion):
    assert np.abs(driven(20 * MS, motion=motion,
                         deviations=0.0 * DEVIATIONS).edge_noise('base').covariance).max() < 1e-16


def test_errors_that_last_look_like_motion():
    """A filter with a time constant of 0.2 s: 2 cm, of which a sixth is seen as noise."""
    rng, buffer, off = np.random.default_rng(3), BufferCore(), 0.0
    rest = np.exp(-0.01 / 0.2)
    for stamp in range(0, 12 * SECOND, 10 * MS):
        off = rest * off + rng.normal(scale=0.02 * np.sqrt(1.0 - rest * rest))
        buffer.insert('odom', 'base', stamp, Pose(x=off))
    assert 0.001 < np.sqrt(buffer.edge_noise('base').covariance[0, 0]) < 0.004


def test_gap_and_jump_of_time_are_no_noise():
    """The samples of half a second are missing, while the robot turns."""
    rng, buffer = np.random.default_rng(4), BufferCore()
    for stamp in range(0, 12 * SECOND, 20 * MS):
        if not 8 * SECOND < stamp < 8500 * MS:
            buffer.insert('odom', 'base', stamp, noisy(turning(stamp / SECOND), rng))
    found = buffer.edge_noise('base').covariance
    np.testing.assert_allclose(np.sqrt(found.diagonal()), DEVIATIONS, rtol=0.25)


def test_last_of_several_samples_with_one_stamp_counts():
    rng, once, twice = np.random.default_rng(5), BufferCore(), BufferCore()
    for stamp in range(0, 12 * SECOND, 20 * MS):
        pose = noisy(turning(stamp / SECOND), rng)
        once.insert('odom', 'base', stamp, pose)
        for each in (Pose(x=7.0), pose):
            twice.insert('odom', 'base', stamp, each)
    np.testing.assert_allclose(twice.edge_noise('base').covariance,
                               once.edge_noise('base').covariance, rtol=1e-9)


def test_noise_depends_on_the_samples_only():
    """Samples arrive late; a snapshot has never learnt anything."""
    rng, buffer, late = np.random.default_rng(6), BufferCore(), []
    for stamp in range(0, 25 * SECOND, 20 * MS):
        sample = 'odom', 'base', stamp, noisy(turning(stamp / SECOND), rng)
        if rng.random() < 0.05:
            late.append(sample)
            continue
        buffer.insert(*sample)
        if rng.random() < 0.05:
            for each in late:
                buffer.insert(*each)
            late = []
        if stamp > SECOND and rng.random() < 0.2:
            np.testing.assert_allclose(
                buffer.edge_noise('base').covariance,
                buffer.snapshot().edge_noise('base').covariance, rtol=1e-9)


def test_noise_of_short_bursts_is_not_taken_for_motion():
    """The residuals of the higher order need seven samples without a gap."""
    rng, expected = np.random.default_rng(7), 0.011
    for length in (5, 6, 7, 8):
        buffer = BufferCore()
        for number in range(250):
            buffer.insert('a', 'c', number * 20 * MS, Pose(x=rng.normal(scale=0.001)))
        for burst in range(16):
            for number in range(length):
                buffer.insert('a', 'c', 5 * SECOND + (burst * 312 + number * 20) * MS,
                              Pose(x=rng.normal(scale=0.02)))
        found = np.sqrt(buffer.edge_noise('c').covariance[0, 0])
        assert 0.4 * expected < found < 1.5 * expected, length


# --- lookups

def test_lookup_uses_the_noise_only_if_asked():
    buffer, now = driven(20 * MS), 8 * SECOND
    assert not buffer.lookup_uncertain('odom', 'base', now)[1].any()
    pose, covariance = buffer.lookup_uncertain('odom', 'base', now, learnt_noise=True)
    assert pose == buffer.lookup('odom', 'base', now)
    turn = np.array(so3.as_matrix(pose[3:]))
    whole = np.kron(np.eye(2), turn)
    noise = whole @ buffer.edge_noise('base').covariance @ whole.T
    # Between two samples with independent noise there is less of it.
    share = covariance[0, 0] / noise[0, 0]
    assert 0.5 <= share <= 1.0
    np.testing.assert_allclose(covariance, share * noise, atol=1e-12)
    latest = buffer.lookup_uncertain('odom', 'base', learnt_noise=True)[1]
    assert latest[2, 2] == pytest.approx(buffer.edge_noise('base').covariance[2, 2], rel=0.01)


def test_budget_of_the_noise_adds_up():
    buffer = driven(20 * MS)
    buffer.insert('base', 'tip', 0, Pose(x=10.0), static=True, covariance=np.diag([1e-6] * 6))
    asked = 'odom', 'tip', 8 * SECOND
    assert [share.child for share in buffer.lookup_budget(*asked)] == ['tip']
    shares = buffer.lookup_budget(*asked, learnt_noise=True)
    assert [share.child for share in shares] == ['base', 'tip']
    np.testing.assert_allclose(
        sum(share.covariance for share in shares),
        buffer.lookup_uncertain(*asked, learnt_noise=True)[1], atol=1e-12)


def test_between_two_samples_there_is_less_noise():
    rng, buffer = np.random.default_rng(7), BufferCore()
    for stamp in range(0, 12 * SECOND, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=rng.normal(scale=0.01)))
    whole = buffer.edge_noise('base').covariance[0, 0]
    for part, share in ((0, 1.0), (5 * MS, 0.75**2 + 0.25**2), (10 * MS, 0.5)):
        found = buffer.lookup_uncertain('odom', 'base', 8 * SECOND + part, learnt_noise=True)
        assert found[1][0, 0] == pytest.approx(share * whole, rel=1e-9)


class Step(Interpolation):
    """Keeps each sample until the next, as in docs/interpolation.md."""

    def between(self, samples, index, stamp):
        return samples.pose(index)


def test_interpolation_that_takes_one_sample_has_its_noise():
    rng, buffer = np.random.default_rng(7), BufferCore()
    buffer.set_interpolation('base', Step())
    for stamp in range(0, 12 * SECOND, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=rng.normal(scale=0.01)))
    for part in (0, 5 * MS, 10 * MS):
        found = buffer.lookup_uncertain('odom', 'base', 8 * SECOND + part, learnt_noise=True)[1]
        assert found[0, 0] == buffer.edge_noise('base').covariance[0, 0]


def test_each_parent_has_the_noise_of_its_samples():
    rng, buffer = np.random.default_rng(7), BufferCore()
    buffer.insert('a', 'b', 0, Pose(), static=True)
    for number in range(450):
        parent, scale = ('a', 0.05) if number < 250 else ('b', 1e-4)
        buffer.insert(parent, 'c', number * 20 * MS, Pose(x=rng.normal(scale=scale)))
    for stamp, expected in ((2 * SECOND, 0.05), (7 * SECOND, 1e-4)):
        for found in (buffer.lookup_uncertain('a', 'c', stamp, learnt_noise=True)[1],
                      buffer.predict('a', 'c', stamp, SECOND).covariance):
            assert np.sqrt(found[0, 0]) == pytest.approx(expected, rel=0.2)
    buffer.insert('a', 'c', 10 * SECOND, Pose())
    before = buffer.lookup_uncertain('a', 'c', 9 * SECOND - 20 * MS, learnt_noise=True)[1]
    assert before[0, 0] < 1e-7
    with pytest.raises(ExtrapolationException, match='a -> c is unknown'):
        buffer.lookup_uncertain('a', 'c', learnt_noise=True)


def test_latest_at_time_zero_has_its_noise():
    rng, buffer = np.random.default_rng(7), BufferCore()
    for stamp in range(-5 * SECOND, 1, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=rng.normal(scale=0.01)))
    found = buffer.lookup_uncertain('odom', 'base', learnt_noise=True)[1]
    assert found[0, 0] == buffer.edge_noise('base').covariance[0, 0]


def test_covariance_of_an_edge_includes_its_noise():
    buffer = driven(20 * MS)
    own = np.diag([1e-4] * 6)
    buffer.insert('odom', 'base', 12 * SECOND, turning(12.0), covariance=own)
    for found in (buffer.lookup_uncertain('odom', 'base', 8 * SECOND, learnt_noise=True)[1],
                  buffer.predict('odom', 'base', 8 * SECOND, SECOND).covariance):
        np.testing.assert_allclose(found, own, atol=1e-15)


def test_far_behind_an_edge_its_rotation_counts():
    buffer = driven(20 * MS)
    buffer.insert('base', 'tip', 0, Pose(x=10.0), static=True)
    covariance = buffer.lookup_uncertain('tip', 'odom', learnt_noise=True)[1]
    back = buffer.lookup_uncertain('odom', 'tip', learnt_noise=True)[1]
    expected = DEVIATIONS[2]**2 + (10.0 * DEVIATIONS[4])**2
    assert back[2, 2] == pytest.approx(expected, rel=0.5)
    assert covariance[5, 5] == pytest.approx(DEVIATIONS[5]**2, rel=0.5)


def test_caller_cannot_change_what_was_learnt():
    buffer = driven(20 * MS)
    with pytest.raises(ValueError, match='read-only'):
        buffer.edge_noise('base').covariance[0, 0] = 1.0


# --- errors

def test_too_few_samples_are_an_error_that_names_the_edge():
    buffer = driven(20 * MS, until=200 * MS)
    with pytest.raises(ExtrapolationException, match=(
            'noise of the edge odom -> base is unknown: to learn it takes some 16 samples')):
        buffer.edge_noise('base')
    with pytest.raises(ExtrapolationException, match='odom -> base is unknown') as raised:
        buffer.lookup_uncertain('odom', 'base', learnt_noise=True)
    assert (raised.value.target_frame, raised.value.source_frame) == ('odom', 'base')


def test_samples_too_far_apart_are_an_error_each_time():
    buffer = BufferCore()
    for number in range(100):
        buffer.insert('odom', 'base', number * 20 * MS, Pose(x=1e160 * (number % 7)))
    for _ in range(2):
        with pytest.raises(ExtrapolationException, match='odom -> base .* too far'):
            buffer.edge_noise('base')


def test_edges_without_samples_have_no_noise_to_learn():
    buffer = driven(20 * MS)
    buffer.insert('base', 'camera', 0, Pose(), static=True)
    with pytest.raises(InvalidArgumentException, match='camera.*it is static'):
        buffer.edge_noise('camera')
    with pytest.raises(InvalidArgumentException, match='odom.*it has no parent'):
        buffer.edge_noise('odom')
    buffer.clear()
    with pytest.raises(InvalidArgumentException, match='base.*it has no parent'):
        buffer.edge_noise('/base')
    with pytest.raises(LookupException, match='edge_noise.*child does not exist'):
        buffer.edge_noise('moon')
    assert not buffer.lookup_uncertain('base', 'camera', learnt_noise=True)[1].any()
