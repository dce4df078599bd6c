# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Gates between two uncertain poses, and covariances for GTSAM."""

import numpy as np
import pytest
from tf_tree_py.beyond.uncertainty.gating import agreement, as_gtsam, from_gtsam
from tf_tree_py.core import InvalidArgumentException, Pose
from tf_tree_py.core.geometry import so3

POSE = Pose.from_xyz_rpy(x=3.0, y=-1.0, z=0.5, roll=0.4, pitch=-0.9, yaw=2.0)
ROOT = 1e-3 * np.random.default_rng(8).normal(size=(6, 6))
COVARIANCE = ROOT @ ROOT.T


@pytest.fixture
def rng():
    """Return a generator of random numbers, the same ones for each test."""
    return np.random.default_rng(9)


def moved(pose, error):
    return Pose.from_parts(np.add(pose[:3], error[:3]), so3.multiply(
        so3.exp(tuple(np.asarray(error[3:]).tolist())), pose[3:]))


def test_good_poses_pass_a_gate_as_often_as_its_probability_says(rng):
    found = [agreement(moved(POSE, ROOT @ rng.normal(size=6)), COVARIANCE,
                       moved(POSE, ROOT @ rng.normal(size=6)), COVARIANCE) for _ in range(2000)]
    squared, probabilities = np.array(found).T
    assert squared.mean() == pytest.approx(6.0, abs=0.4)
    for gate in (0.05, 0.5):
        assert (probabilities < gate).mean() == pytest.approx(gate, abs=0.04)


def test_what_is_certain_has_to_be_equal():
    certain = np.diag([1e-4, 1e-4, 0, 0, 0, 1e-4])
    aside = agreement(POSE, certain, moved(POSE, (0.01, 0, 0, 0, 0, 0)), 0 * certain)
    assert aside.squared_distance == pytest.approx(1.0)
    assert aside.probability == pytest.approx(0.801, abs=1e-3)  # chi^2 of 3 degrees of freedom
    assert agreement(POSE, certain, moved(POSE, (0, 0, 0.01, 0, 0, 0)), certain).probability == 0
    assert agreement(POSE, 0 * certain, POSE, 0 * certain).probability == 1.0
    with pytest.raises(InvalidArgumentException, match='covariance'):
        agreement(POSE, -np.eye(6), POSE, certain)


def test_gtsam_has_the_rotation_first_and_errors_on_the_side_of_the_body():
    """T Exp(xi), with the GTSAM covariance of xi, has errors with our covariance."""
    tangents = np.linalg.cholesky(as_gtsam(POSE, COVARIANCE)).T * np.sqrt(6.0)
    errors = []
    for rotation, shift in ((xi[:3], xi[3:]) for xi in (*tangents, *-tangents)):
        turned = so3.multiply(POSE[3:], so3.exp(tuple(rotation.tolist())))
        there = np.add(POSE[:3], so3.rotate(POSE[3:], tuple(shift.tolist())))
        errors.append((*(there - POSE[:3]), *so3.log(so3.multiply(
            turned, so3.conjugate(POSE[3:])))))
    np.testing.assert_allclose(np.array(errors).T @ errors / 12, COVARIANCE, rtol=1e-3,
                               atol=1e-9)
    np.testing.assert_allclose(from_gtsam(POSE, as_gtsam(POSE, COVARIANCE)), COVARIANCE,
                               atol=1e-18)


def test_gtsam_says_the_same(rng):
    gtsam = pytest.importorskip('gtsam', reason='needs gtsam: pip install gtsam')
    here = gtsam.Pose3(gtsam.Rot3(np.array(so3.as_matrix(POSE[3:]))), np.array(POSE[:3]))
    error = 1e-6 * rng.normal(size=6)
    there = moved(POSE, error)
    xi = here.localCoordinates(gtsam.Pose3(
        gtsam.Rot3(np.array(so3.as_matrix(there[3:]))), np.array(there[:3])))
    np.testing.assert_allclose(np.outer(xi, xi), as_gtsam(POSE, np.outer(error, error)),
                               atol=1e-16)
