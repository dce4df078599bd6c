# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The random inputs of the core's tests, and the comparison of results.

Rotations and translations include the sizes at which code fails: angles of 1e-12 rad
and near pi, both signs of a quaternion, distances of a millimetre and of a
thousand kilometres.
"""

import math

from hypothesis import strategies as st
import numpy as np
from tf_tree_py.core.geometry import so3

MILLION = 1e6

components = st.floats(-1.0, 1.0, allow_subnormal=False)


def _unit(vector):
    size = math.hypot(*vector)
    return tuple(value / size for value in vector) if size > 1e-3 else (0.0, 0.0, 1.0)


axes = st.one_of(
    st.sampled_from([(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)]),
    st.tuples(components, components, components).map(_unit),
)

tiny_angles = st.floats(-12.0, -6.0).map(lambda power: 10.0 ** power)
angles = st.one_of(
    st.just(0.0),
    tiny_angles,
    st.floats(1e-6, math.pi),
    # Near the angles at which formulas switch to or from a series.
    st.sampled_from([1e-3, 0.1, math.pi / 2, math.pi]).flatmap(
        lambda angle: st.floats(-12.0, -2.0).map(lambda power: max(angle - 10.0 ** power, 0.0))),
    st.just(math.pi),
)


def about(axis, angle, sign=1.0):
    """Return the quaternion of a rotation, or its negative, which is the same rotation."""
    half = 0.5 * angle
    x, y, z = (sign * math.sin(half) * value for value in axis)
    return (x, y, z, sign * math.cos(half))


signs = st.sampled_from([1.0, -1.0])
quaternions = st.builds(about, axes, angles, signs)
tiny_quaternions = st.builds(about, axes, tiny_angles, signs)

vectors = st.one_of(
    st.just((0.0, 0.0, 0.0)),
    st.tuples(components, components, components),
    st.tuples(*[st.floats(-MILLION, MILLION, allow_subnormal=False)] * 3),
)
ratios = st.one_of(st.sampled_from([0.0, 0.5, 1.0]), st.floats(0.0, 1.0, allow_subnormal=False))

poses = st.builds(lambda translation, rotation: (*translation, *rotation), vectors, quaternions)
twists = st.builds(
    lambda translation, axis, angle: (*translation, *(angle * value for value in axis)),
    vectors, axes, angles)


def random_poses(rng, count, reach=1.0):
    """Return (count, 7) poses with uniformly distributed rotations, from a numpy generator."""
    rotations = rng.normal(size=(count, 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    return np.concatenate([rng.uniform(-reach, reach, (count, 3)), rotations], axis=-1)


def random_pose(rng, reach=1.0):
    """Return one of ``random_poses`` as plain floats."""
    return tuple(random_poses(rng, 1, reach)[0].tolist())


def waving_poses(seconds):
    """Return the poses (N, 7) of a hand-held object: about 3 m/s, 50 m/s^2 and 6 rad/s."""
    t = np.asarray(seconds)
    turns = np.stack([0.4 * np.sin(8.0 * t), 0.3 * np.cos(12.0 * t), 0.5 * np.sin(5.0 * t) + t], 1)
    places = np.stack([0.3 * np.sin(6.0 * t), 0.2 * np.cos(13.0 * t), 0.1 * np.sin(19.0 * t)], 1)
    return np.concatenate([places, so3.exp_many(turns)], axis=1)


def angle_between(a, b):
    """Return the angle between two rotations; exact even for tiny angles."""
    x, y, z, w = so3.multiply(so3.conjugate(a), b)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def assert_same_rotation(a, b, tolerance=1e-14):
    """Assert that two quaternions are the same rotation, whatever their signs."""
    assert angle_between(a, b) <= tolerance, f'{a} and {b} are {angle_between(a, b)} rad apart'


def assert_same_pose(a, b, tolerance=1e-14, reach=1.0):
    """
    Assert that two poses are equal.

    :param tolerance: radians, and metres for every metre of reach.
    :param reach: the longest distance in their computation, metres.
    """
    assert_same_rotation(a[3:], b[3:], tolerance)
    gap = math.dist(a[:3], b[:3])
    assert gap <= tolerance * max(1.0, reach), f'{a} and {b} are {gap} m apart'


def length(pose):
    """Return the distance of a pose's origin from its parent's, metres."""
    return math.hypot(*pose[:3])
