# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The derivatives of the residuals equal finite differences, for every kind of path."""

from calibration_scenes import at
from hypothesis import given, strategies as st
import numpy as np
from scipy.spatial.transform import Rotation
from tf_tree_py import BufferCore
from tf_tree_py.calibration import Limits, Observations
from tf_tree_py.calibration.model import between_many, Model, moved_many, State
from tf_tree_py.core import Pose, UNLIMITED

STEP = 1e-6


def random_pose(rng):
    return Pose(*rng.normal(size=3).tolist(), *Rotation.random(random_state=rng).as_quat())


def tree_of(rng):
    """Return a tree with a branch: a static edge on each side, and a moving one."""
    buffer = BufferCore(cache_time=UNLIMITED)
    seconds = np.arange(0.0, 4.0, 0.002)
    waves = np.sin(np.outer(seconds, rng.uniform(0.2, 0.6, 6)) + rng.uniform(0, 6, 6))
    buffer.insert_track('root', 'base', at(seconds), np.concatenate(
        [waves[:, :3], Rotation.from_rotvec(waves[:, 3:]).as_quat()], axis=1))
    buffer.insert('base', 'camera', 0, random_pose(rng), static=True)
    buffer.insert('root', 'table', 0, random_pose(rng), static=True)
    return buffer


def state_of(buffer, model, rng):
    return State(np.array([buffer.lookup(*edge) for edge in model.unknowns.edges]),
                 rng.uniform(-0.02, 0.02, 1),
                 np.array([random_pose(rng) for _ in model.unknowns.targets]).reshape(-1, 7))


@given(st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_derivatives_are_those_of_differences(seed, points, known):
    rng = np.random.default_rng(seed)
    buffer = tree_of(rng)
    place = random_pose(rng) if known else None
    sets = Observations('camera', at(np.linspace(1.0, 3.0, 4)),
                        np.array([random_pose(rng) for _ in range(4)]), 'table', place=place)
    edges = [('base', 'camera'), ('root', 'table')]     # one is traversed down, one up
    probe = Model(buffer, edges, [sets], Limits())
    probe.reach = 0.5
    state = state_of(buffer, probe, rng)
    near = moved_many(probe.placed(0, state).pose, rng.normal(size=(4, 6)) * 0.3)
    seen = near[:, :3] if points else near
    model = Model(buffer, edges, [Observations(
        'camera', sets.stamps, seen, 'table',
        place=None if place is None else place[:seen.shape[1]])], Limits())
    model.reach = 0.5
    derivatives = model.derivatives(0, state)
    for number in range(model.unknowns.size):
        size = 1e-3 if number == model.unknowns.offset('camera') else STEP
        step = np.zeros(model.unknowns.size)
        step[number] = size
        above, below = (model.residuals(model.unknowns.moved(state, sign * step))[0]
                        for sign in (1.0, -1.0))
        np.testing.assert_allclose(derivatives[:, :, number], (above - below) / (2.0 * size),
                                   atol=2e-3 if size == 1e-3 else 1e-6)


@given(st.integers(0, 2**32 - 1))
def test_step_to_a_state_leads_there(seed):
    rng = np.random.default_rng(seed)
    poses = np.array([random_pose(rng) for _ in range(5)])
    steps = rng.normal(size=(5, 6))
    there = moved_many(poses, steps)
    np.testing.assert_allclose(between_many(poses, there)[:, :3], steps[:, :3], atol=1e-12)
    np.testing.assert_allclose(
        np.abs((moved_many(poses, between_many(poses, there))[:, 3:] * there[:, 3:]).sum(axis=1)),
        1.0, atol=1e-12)
