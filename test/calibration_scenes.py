# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Robots with a camera whose mounting and stamps are wrong by a known amount."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from tf_tree_py import BufferCore
from tf_tree_py.calibration import Observations
from tf_tree_py.core import Pose, se3, UNLIMITED

START = 1_700_000_000 * 10**9
EDGE = ('base', 'camera')
TRUE = Pose.from_xyz_rpy(x=0.2, y=0.1, z=0.5, roll=-1.9, pitch=0.1, yaw=-1.5)
PLACE = Pose.from_xyz_rpy(x=3.0, y=0.5, z=0.7, yaw=0.4)


class Scene(NamedTuple):
    """
    A tree, and the observations of its camera.

    :ivar true: the true ``base_T_camera``; the tree contains another one.
    """

    buffer: BufferCore
    observations: Observations
    true: Pose


def scene(seed=0, count=200, *, offset_s=0.08, turned_deg=1.0, moved_m=0.0, noise_m=0.002,
          noise_rad=0.002, speed=1.0, planar=False, turning=1.0, driving=1.0, points=False,
          outliers=0.0, duration_s=15.0):
    """
    Return a scene with a moving robot that observes a target at rest in the map.

    :param turning: the amount of rotation, and ``driving`` that of translation; 1 is a lot.
    """
    rng = np.random.default_rng(seed)
    phases, rates = rng.uniform(0.0, 2.0 * np.pi, 6), rng.uniform(0.3, 0.9, 6)

    def map_T_base(seconds):
        waves = np.sin(np.outer(seconds * speed, rates) + phases)
        moved = driving * waves[:, :3] * [0.8, 0.8, 0.0 if planar else 0.3]
        turned = turning * waves[:, 3:] * ([0.0, 0.0, 0.8] if planar else [0.4, 0.4, 0.8])
        return np.concatenate([moved, Rotation.from_rotvec(turned).as_quat()], axis=1)

    axis, direction = (each / np.linalg.norm(each) for each in rng.normal(size=(2, 3)))
    wrong = Pose(*(np.array(TRUE[:3]) + moved_m * direction).tolist(), *(
        Rotation.from_rotvec(np.radians(turned_deg) * axis)
        * Rotation.from_quat(TRUE[3:])).as_quat().tolist())
    buffer = BufferCore(cache_time=UNLIMITED)
    grid = np.arange(-1.0, duration_s + 1.0, 0.01)
    buffer.insert_track('map', 'base', at(grid), map_T_base(grid))
    buffer.insert(*EDGE, 0, wrong, static=True)

    taken = np.sort(rng.uniform(0.0, duration_s, count))
    camera = se3.compose_many(map_T_base(taken), np.tile(TRUE, (count, 1)))
    seen = se3.compose_many(se3.inverse_many(camera), np.tile(PLACE, (count, 1)))
    seen[:, :3] += rng.normal(size=(count, 3)) * noise_m
    seen[:, 3:] = (Rotation.from_rotvec(rng.normal(size=(count, 3)) * noise_rad)
                   * Rotation.from_quat(seen[:, 3:])).as_quat()
    bad = rng.permutation(count)[:round(outliers * count)]
    seen[bad, :3] += rng.normal(size=(len(bad), 3))
    seen[bad, 3:] = Rotation.random(len(bad), rng).as_quat()
    return Scene(buffer, Observations('camera', at(taken + offset_s),
                                      seen[:, :3] if points else seen, 'map'), TRUE)


def with_target_moved(given, shift):
    """
    Return the observations of a scene as if its target moved in the map.

    :param shift: from seconds since the start (N,) to metres (N, 3).
    """
    sets = given.observations
    camera = se3.compose_many(given.buffer.lookup_many('map', 'base', sets.stamps),
                              np.tile(given.true, (len(sets), 1)))
    target = se3.compose_many(camera, sets.seen)
    target[:, :3] += shift((sets.stamps - START) / 1e9)
    return Observations('camera', sets.stamps, se3.compose_many(se3.inverse_many(camera), target),
                        'map')


def direction(seed):
    """Return a unit vector (3,)."""
    vector = np.random.default_rng(seed).normal(size=3)
    return vector / np.linalg.norm(vector)


def at(seconds):
    """Return the stamps of times in seconds since the start."""
    return START + np.round(np.asarray(seconds) * 1e9).astype(np.int64)


def errors(found, true):
    """Return the error of an edge: (6,) in the convention of its covariance."""
    turn = Rotation.from_quat(found[3:]) * Rotation.from_quat(true[3:]).inv()
    return np.concatenate([np.subtract(found[:3], true[:3]), turn.as_rotvec()])
