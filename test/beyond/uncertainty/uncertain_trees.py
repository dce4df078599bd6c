# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Random trees of uncertain edges, and their errors by draws, to verify the formulas."""

import numpy as np
from strategies import random_pose
from tf_tree_py import BufferCore
from tf_tree_py.core.geometry import se3, so3

DRAWS = 20_000


def random_covariance(rng, metres, radians):
    """Return a covariance with correlations, and deviations up to these."""
    square = rng.normal(size=(6, 8))
    matrix = square @ square.T
    deviations = rng.uniform(0.3, 1.0, 6) * np.repeat([metres, radians], 3)
    factors = deviations / np.sqrt(matrix.diagonal())
    return matrix * np.outer(factors, factors)


class RandomTree:
    """
    Static edges under one root, most of them uncertain; the arms are metres long.

    :ivar edges: (parent, pose, covariance or None) by child.
    """

    def __init__(self, rng, frames, degrees):
        self.buffer, self.edges = BufferCore(), {}
        self.rng = rng
        names = [f'f{number}' for number in range(frames)]
        for number, child in enumerate(names[1:], start=1):
            parent = names[rng.integers(max(0, number - 3), number)]
            pose = random_pose(rng, reach=2.0)
            covariance = None
            if rng.random() < 0.8 or number == frames - 1:
                covariance = random_covariance(rng, 0.03, np.radians(degrees))
            self.edges[child] = parent, pose, covariance
            self.buffer.insert(parent, child, 0, pose, static=True, covariance=covariance)

    def drawn(self, target, source):
        """Return drawn errors of ``target_T_source`` (DRAWS, 6)."""
        edges = {child: (parent, drawn_poses(self.rng, pose, covariance))
                 for child, (parent, pose, covariance) in self.edges.items()}

        def root_T(frame):
            poses = np.tile(se3.IDENTITY, (DRAWS, 1))
            while frame in edges:
                frame, parent_T_frame = edges[frame]
                poses = se3.compose_many(parent_T_frame, poses)
            return poses

        return errors_of(se3.compose_many(se3.inverse_many(root_T(target)), root_T(source)),
                         self.buffer.lookup(target, source))


def drawn_poses(rng, pose, covariance):
    """Return poses (DRAWS, 7) whose errors have a covariance."""
    poses = np.tile(pose, (DRAWS, 1))
    if covariance is not None:
        errors = rng.multivariate_normal(np.zeros(6), covariance, DRAWS)
        poses = moved(poses, errors)
    return poses


def moved(poses, errors):
    """Return poses with errors (N, 6) applied, literally in the convention of the covariance."""
    return np.concatenate([poses[:, :3] + errors[:, :3], so3.multiply_many(
        so3.exp_many(errors[:, 3:]), poses[:, 3:])], axis=-1)


def errors_of(poses, pose):
    """Return the errors of poses (N, 7) relative to one, (N, 6)."""
    turned = so3.multiply_many(poses[:, 3:], so3.conjugate_many(np.array(pose[3:])))
    return np.concatenate([poses[:, :3] - pose[:3], so3.log_many(turned)], axis=-1)


def assert_explained(covariance, errors, sigmas=5.0):
    """Assert that sampling explains each entry of a covariance, within 0.2 % of its scale."""
    products = errors[:, :, None] * errors[:, None, :]
    drawn = products.mean(axis=0)
    scale = np.sqrt(np.outer(drawn.diagonal(), drawn.diagonal()))
    off = np.abs(covariance - drawn) / (
        sigmas * products.std(axis=0) / np.sqrt(len(errors)) + 2e-3 * scale + 1e-15)
    assert off.max() < 1.0, (off, covariance, drawn)
