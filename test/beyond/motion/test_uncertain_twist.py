# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The covariance of a velocity, compared with the errors of noisy samples of known motions."""

import numpy as np
import pytest
from tf_tree_py import BufferCore, ConstantTwist
from tf_tree_py.beyond.motion.twist import lookup_twist
from tf_tree_py.beyond.motion.uncertain_twist import lookup_twist_uncertain
from tf_tree_py.core import ExtrapolationException, Pose, se3
from tf_tree_py.core.geometry import so3
from tf_tree_py.screws import exp, times

SECOND = 1_000_000_000
STEP = SECOND // 50
SPAN = 4 * SECOND
SEEDS = 40

# Each edge moves along one screw, per second, so the mean over any interval is exact.
EDGES = {
    ('world', 'base'): (Pose(x=3.0), (0.5, 0.0, 0.0, 0.0, 0.1, 0.8)),
    ('base', 'arm'): (Pose.from_xyz_rpy(0.3, 0.1, 0.4, 0.2), (0.0, 0.0, 0.0, 0.9, 0.0, 0.0)),
    ('world', 'lift'): (Pose.from_xyz_rpy(y=-2.0, yaw=1.0), (0.0, 0.1, 0.3, 0.0, 0.0, -0.5)),
}
MOUNT = Pose.from_xyz_rpy(0.2, 0.0, -0.1, 0.5, -0.3, 1.0)


def noise_of(number):
    """Return a covariance with correlations: millimetres and some tenths of a degree."""
    rng = np.random.default_rng(number)
    root = np.diag([2e-3] * 3 + [3e-3] * 3) @ rng.normal(size=(6, 6))
    return root @ root.T / 6.0


def tree_of(rng=None):
    """Return the tree, with noise if a generator is given."""
    buffer = BufferCore()
    stamps = np.arange(0, SPAN + 1, STEP)
    for number, ((parent, child), (start, twist)) in enumerate(EDGES.items()):
        offs = np.zeros((len(stamps), 6)) if rng is None else rng.multivariate_normal(
            np.zeros(6), noise_of(number), len(stamps))
        for stamp, (x, y, z, *turn) in zip(stamps.tolist(), offs.tolist(), strict=True):
            pose = se3.compose(start, exp(times(stamp / SECOND, twist)))
            buffer.insert(parent, child, stamp, Pose._make(
                se3.compose(pose, (x, y, z, *so3.exp(tuple(turn))))))
    buffer.insert('arm', 'tool', 0, MOUNT, static=True)
    return buffer


@pytest.fixture(scope='module')
def trees():
    return tree_of(), [tree_of(np.random.default_rng(seed)) for seed in range(SEEDS)]


ASKED = {
    'one edge': ('base', 'world', {}),
    'upwards': ('world', 'base', {}),
    'a chain': ('tool', 'world', {}),
    'both ways': ('tool', 'lift', {}),
    'own axes': ('tool', 'lift', {'reference_frame': 'tool'}),
    'other axes and point': ('tool', 'lift', {
        'reference_frame': 'world', 'reference_point': (0.0, 0.3, 1.0),
        'reference_point_frame': 'arm'}),
}


@pytest.mark.parametrize('interval', [STEP // 2, 5 * STEP + STEP // 4, SECOND])
@pytest.mark.parametrize('asked', ASKED)
def test_errors_are_as_large_as_the_covariance_says(asked, interval, trees):
    """The mean NEES of n independent errors is 6, give or take sqrt(12 / n): here five sigmas."""
    tracking, observation, reference = ASKED[asked]
    exact, noisy = trees
    distances = []
    for stamp in (SPAN // 2 + STEP // 3, SPAN):
        truth = lookup_twist(exact, tracking, observation, stamp, interval, **reference)
        for tree in noisy:
            velocity, covariance = lookup_twist_uncertain(
                tree, tracking, observation, stamp, interval, **reference)
            assert velocity == lookup_twist(
                tree, tracking, observation, stamp, interval, **reference)
            off = np.subtract(velocity.linear + velocity.angular, truth.linear + truth.angular)
            distances.append(off @ np.linalg.solve(covariance, off))
    assert np.mean(distances) == pytest.approx(6.0, abs=5.0 * np.sqrt(12.0 / len(distances)))


def test_static_edges_and_curves_are_certain():
    buffer = tree_of()
    velocity, covariance = lookup_twist_uncertain(buffer, 'tool', 'arm', 0, SECOND)
    assert velocity.linear == (0.0, 0.0, 0.0) and not covariance.any()
    buffer.insert_curve('world', 'earth', ConstantTwist(
        0, SPAN, Pose(), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)))
    velocity, covariance = lookup_twist_uncertain(buffer, 'earth', 'world', SECOND, SECOND)
    assert velocity.angular == pytest.approx((0.0, 0.0, 1.0)) and not covariance.any()


def test_edge_with_too_few_samples_is_named_with_the_frames():
    buffer = BufferCore()
    for number in range(10):
        buffer.insert('odom', 'base', number * STEP, Pose(x=0.1 * number))
    with pytest.raises(ExtrapolationException, match='odom -> base is unknown') as raised:
        lookup_twist_uncertain(buffer, 'base', 'odom', 4 * STEP, STEP)
    assert (raised.value.target_frame, raised.value.source_frame) == ('odom', 'base')


def test_edges_of_the_axes_count_at_the_stamp_only():
    """Those of a slower map do not reach the end of the interval, or have just begun."""
    buffer, stamp = tree_of(np.random.default_rng(1)), SPAN // 2
    rng = np.random.default_rng(2)
    for number in range(40):
        buffer.insert('map', 'world', stamp - number * STEP, Pose(x=rng.normal(scale=1e-3)))
    asked = 'base', 'world', stamp, SECOND
    velocity, covariance = lookup_twist_uncertain(buffer, *asked, reference_frame='map')
    assert velocity == lookup_twist(buffer, *asked, reference_frame='map')
    assert np.linalg.eigvalsh(covariance)[0] > 0.0


def test_frame_that_had_another_parent_has_the_velocity_of_that_time():
    rng, buffer = np.random.default_rng(1), tree_of(np.random.default_rng(2))
    for number in range(100):
        buffer.insert('lift', 'base', SPAN + STEP * (1 + number), Pose(
            x=rng.normal(scale=1e-3)))
    asked = 'base', 'world', SPAN // 2, SECOND
    velocity, covariance = lookup_twist_uncertain(buffer, *asked)
    assert velocity == lookup_twist(buffer, *asked)
    assert np.linalg.eigvalsh(covariance)[0] > 0.0
