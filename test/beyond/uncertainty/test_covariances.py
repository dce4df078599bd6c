# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The formulas of covariances, compared with draws, and their invariances."""

import numpy as np
import pytest
from strategies import random_pose
from tf_tree_py import screws
from tf_tree_py.beyond.uncertainty import covariances, propagation
from tf_tree_py.core import InvalidArgumentException, se3
from tf_tree_py.core.geometry import so3
from uncertain_trees import (
    assert_explained,
    drawn_poses,
    DRAWS,
    errors_of,
    moved,
    random_covariance,
)


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def test_packed_covariance_comes_back(rng):
    matrices = np.array([random_covariance(rng, 1.0, 0.1) for _ in range(3)])
    assert covariances.pack(matrices).shape == (3, 21)
    np.testing.assert_array_equal(covariances.unpack(covariances.pack(matrices)), matrices)


def test_both_shapes_of_a_covariance_are_taken(rng):
    matrix = random_covariance(rng, 1.0, 0.1)
    np.testing.assert_allclose(covariances.checked_covariance(matrix.ravel().tolist()), matrix)
    np.testing.assert_allclose(covariances.checked_covariance(matrix.astype(np.float32)), matrix,
                               rtol=1e-6)
    assert not covariances.checked_covariance(np.zeros(36)).any()


def spoilt(row, column, value):
    matrix = np.diag([1e4, 1.0, 1.0, 1e-8, 1e-8, 1e-8])
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(('given', 'sentence'), [
    (np.ones(6), r'not \(6,\); np.diag makes one'),
    (np.eye(5), r'not \(5, 5\)'),
    (1j * np.eye(6), r'must be \(6, 6\) numbers'),
    ('much', r'must be \(6, 6\) numbers'),
    ([[1.0], [2.0, 3.0]], r'must be \(6, 6\) numbers'),
    (spoilt(0, 0, np.nan), 'not finite'),
    (spoilt(0, 0, 1e101), r'variance of x is 1e\+101, which is more than the limit'),
    (spoilt(4, 4, -1e-9), 'variance of rotation about y is -1e-09'),
    (spoilt(0, 0, -1.0), 'in messages -1 means unknown'),
    (spoilt(3, 4, 1e-9), r'not symmetric, \[3, 4\] is 1e-09 and \[4, 3\] is 0'),
    (spoilt(3, 4, 3e-8) + spoilt(4, 3, 3e-8), 'not positive semidefinite'),
    (spoilt(0, 3, 0.1) + spoilt(3, 0, 0.1), 'not positive semidefinite'),
])
def test_what_is_no_covariance_is_told(given, sentence):
    with pytest.raises(InvalidArgumentException, match=sentence):
        covariances.checked_covariance(given)


def test_composition_is_what_draws_say(rng):
    first, second = random_pose(rng, 3.0), random_pose(rng, 3.0)
    of_first, of_second = (random_covariance(rng, 0.02, 0.01) for _ in range(2))
    drawn = se3.compose_many(drawn_poses(rng, first, of_first),
                             drawn_poses(rng, second, of_second))
    assert_explained(covariances.composed(first, of_first, second, of_second),
                     errors_of(drawn, se3.compose(first, second)))


def ends(rng):
    """Return two poses a radian apart, and their covariances."""
    first = random_pose(rng)
    second = se3.compose(first, screws.exp((0.3, -0.2, 0.1, 0.5, 0.6, -0.6)))
    return first, second, random_covariance(rng, 0.02, 0.02), random_covariance(rng, 0.04, 0.01)


def between(first, second, before, after, ratio, independent):
    turn = so3.log(se3.compose(second, se3.inverse(first))[3:])
    before, after = covariances.pack(before), covariances.pack(after)
    return covariances.unpack(np.array(covariances.between_rows(
        before, after, np.array(ratio), np.array(turn), independent)))


def interpolated(first, second, ratio):
    return se3.interpolate_many(first, second, np.full(len(first), ratio))


@pytest.mark.parametrize('ratio', [0.0, 0.3, 0.9])
def test_between_two_independent_poses_is_what_draws_say(ratio, rng):
    first, second, before, after = ends(rng)
    drawn = interpolated(drawn_poses(rng, first, before), drawn_poses(rng, second, after), ratio)
    assert_explained(between(first, second, before, after, ratio, True),
                     errors_of(drawn, se3.interpolate(first, second, ratio)))


@pytest.mark.parametrize('ratio', [0.0, 0.3, 0.9])
def test_between_two_poses_bounds_whatever_their_errors_have_in_common(ratio, rng):
    first, second, before, after = ends(rng)
    bound = between(first, second, before, after, ratio, False)
    roots = [np.linalg.cholesky(matrix) for matrix in (before, after)]
    for mixing in (np.eye(6), -np.eye(6), np.zeros((6, 6)),
                   np.linalg.qr(rng.normal(size=(6, 6)))[0]):
        draws = rng.normal(size=(DRAWS, 6))
        others = draws @ mixing + rng.normal(size=draws.shape) * (not mixing.any())
        poses = [moved(np.tile(pose, (DRAWS, 1)), white @ root.T) for pose, white, root in zip(
            (first, second), (draws, others), roots, strict=True)]
        errors = errors_of(interpolated(*poses, ratio), se3.interpolate(first, second, ratio))
        slack = np.linalg.inv(np.linalg.cholesky(bound))
        assert np.linalg.eigvalsh(slack @ (errors.T @ errors / DRAWS) @ slack.T)[-1] < 1.06


@pytest.mark.parametrize('turn', [0.1, 0.5, 2.5])
@pytest.mark.parametrize('sigma', [0.01, 0.1])
def test_bound_between_two_poses_lacks_the_squares_of_the_angles(sigma, turn, rng):
    """They only matter in a direction of which much is known: see the page uncertainty."""
    broken = 0.0
    for _ in range(40):
        # All odd moments are zero, and the second ones exact.
        draws = rng.normal(size=(1000, 6))
        draws = np.concatenate([draws, -draws])
        draws = np.linalg.solve(np.linalg.cholesky(draws.T @ draws / len(draws)), draws.T).T
        roots = np.zeros((2, 6, 6))
        for root in roots:
            thin = sigma * np.array([1.0, rng.choice([1.0, 1e-5]), 1e-5])
            root[3:, 3:] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * thin
            root[:3, :3] = 1e-3 * np.eye(3)
        before, after = roots @ roots.swapaxes(1, 2)
        first = se3.IDENTITY
        axis = rng.normal(size=3)
        second = (0.0, 0.0, 0.0, *so3.exp(tuple(turn / np.linalg.norm(axis) * axis)))
        ratio = rng.uniform(0.05, 0.95)
        bound = between(first, second, before, after, ratio, False)
        mixing = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        poses = [moved(np.tile(pose, (len(draws), 1)), white @ root.T)
                 for pose, white, root in zip((first, second), (draws, draws @ mixing), roots,
                                              strict=True)]
        errors = errors_of(interpolated(*poses, ratio), se3.interpolate(first, second, ratio))
        moment = (errors.T @ errors / len(errors))[3:, 3:]
        angles = max(matrix[3:, 3:].trace() for matrix in (before, after))
        least = (1.0 + 2.0 * angles) * bound[3:, 3:] + (turn * angles / 10.0)**2 * np.eye(3)
        slack = np.linalg.inv(np.linalg.cholesky(least))
        assert np.linalg.eigvalsh(slack @ moment @ slack.T)[-1] < 1.0
        slack = np.linalg.inv(np.linalg.cholesky(bound[3:, 3:]))
        broken = max(broken, np.linalg.eigvalsh(slack @ moment @ slack.T)[-1])
    assert broken > 2.0


def test_between_two_poses_with_the_same_error_is_its_covariance(rng):
    pose, _, covariance, _ = ends(rng)
    for ratio in (0.0, 0.25, 1.0):
        np.testing.assert_allclose(
            between(pose, pose, covariance, covariance, ratio, False), covariance, rtol=1e-12)


def test_between_independent_poses_is_surer_than_either(rng):
    pose, _, covariance, _ = ends(rng)
    np.testing.assert_allclose(
        between(pose, pose, covariance, covariance, 0.5, True), 0.5 * covariance, rtol=1e-12)


@pytest.mark.parametrize('angle', [0.0, 1e-9, 1e-3, 0.9, 3.1])
@pytest.mark.parametrize('ratio', [1e-9, 0.3, 0.999])
def test_ends_of_one_edge_are_those_of_many(ratio, angle):
    turn = np.array([0.6, -0.48, 0.64]) * angle
    first, last = covariances.ends_turned(np.array(ratio), tuple(turn))
    for sign in (1.0, -1.0):
        quaternion = tuple(sign * number for number in so3.exp(tuple(turn)))
        np.testing.assert_allclose(covariances.ends_turned_once(ratio, quaternion),
                                   [*first, *last], rtol=1e-9, atol=1e-11)


def test_left_jacobian_is_the_derivative_of_exp(rng):
    for size in (0.0, 1e-4, 0.09, 0.11, 2.0):
        vector = np.array([0.6, 0.0, -0.8]) * size
        step = 1e-7 * rng.normal(size=3)
        moved = so3.multiply(so3.exp(tuple(vector + step)), so3.conjugate(so3.exp(tuple(vector))))
        np.testing.assert_allclose(screws.left_jacobian_many(vector) @ step, so3.log(moved),
                                   atol=2e-14)


def test_draws_have_exact_moments():
    draws = propagation.exact_draws(18)
    np.testing.assert_allclose(draws.mean(axis=1), 0.0, atol=1e-15)
    np.testing.assert_allclose(draws @ draws.T / draws.shape[1], np.eye(18), atol=1e-12)


@pytest.mark.parametrize('edges', [1, 2, 5, 10])
def test_cubature_is_exact_to_the_fifth_degree(edges):
    values, chosen, weights = propagation.cubature(edges)
    points = values[:, chosen].swapaxes(0, 1).reshape(3 * edges, -1)
    first, second, last = points[0], points[1], points[-1]
    for moment, expected in ((1.0, 1), (first, 0), (first ** 2, 1), (first * second, 0),
                             (first ** 4, 3), (first ** 2 * last ** 2, 1), (first ** 3 * last, 0),
                             (first ** 2 * second * last, 0), (first ** 5, 0)):
        assert np.sum(weights * moment) == pytest.approx(expected, abs=1e-9)


def several_errors(seed, degrees):
    """Return five edges with angular errors, to be propagated to a point."""
    rng = np.random.default_rng(seed)
    covariances = np.array([random_covariance(rng, 0.03, np.radians(degrees)) for _ in range(5)])
    return 2.0 * rng.normal(size=(5, 3)), covariances, rng.random(5) < 0.5, rng.normal(size=3)


@pytest.mark.parametrize(('degrees', 'tolerance'), [(0.2, 5e-5), (1.0, 1e-3), (3.0, 1e-2)])
@pytest.mark.parametrize('seed', range(3))
def test_cubature_and_draws_agree_and_nothing_jumps_between_them(seed, degrees, tolerance):
    errors = several_errors(seed, degrees)
    cubature, draws = propagation.by_cubature(*errors), propagation.by_draws(*errors)
    scale = np.sqrt(np.outer(draws.diagonal(), draws.diagonal()))
    assert (np.abs(cubature - draws) / scale).max() < tolerance


def test_cubature_takes_edges_whose_rotation_is_certain():
    places, covariances, upwards, point = several_errors(7, 1.0)
    covariances[1, 3:] = covariances[1, :, 3:] = 0.0
    covariances[2, 5] = covariances[2, :, 5] = 0.0
    errors = places, covariances, upwards, point
    np.testing.assert_allclose(propagation.by_cubature(*errors),
                               propagation.by_draws(*errors), atol=1e-5)
