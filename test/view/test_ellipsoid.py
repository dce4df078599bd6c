# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The ellipsoid of a frame's uncertain position, as plain data."""

from hypothesis import given, strategies as st
from hypothesis.extra import numpy as st_numpy
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import so3
from tf_tree_py.view.model.moment import ellipsoid, moment_at

SECOND = 1_000_000_000


def robot(covariance):
    """Return odom -> base, at 1 s and 2 s, and a camera whose pose has a covariance."""
    buffer = BufferCore()
    for second in (1, 2):
        buffer.insert('odom', 'base', second * SECOND,
                      Pose.from_xyz_rpy(x=1.0, yaw=np.pi / 2), covariance=np.zeros((6, 6)))
    buffer.insert('base', 'camera', 0, Pose(z=0.5), static=True, covariance=covariance)
    return buffer


def of(buffer, frame, stamp=SECOND, fixed_frame='odom'):
    return ellipsoid(buffer, moment_at(buffer, fixed_frame, stamp), frame)


@given(st_numpy.arrays(float, (3, 3), elements=st.floats(-1.0, 1.0)))
def test_it_is_two_sigma_of_the_position_in_the_fixed_frame(root):
    # Thicker than the limit below which it is drawn as a disc.
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = root @ root.T + 0.01 * np.eye(3)
    buffer = robot(covariance)
    place, rotation, semi_axes = of(buffer, 'camera')
    assert moment_at(buffer, 'odom', SECOND).frames[place] == 'camera'
    turn = np.array(so3.as_matrix(rotation))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    told = buffer.lookup_uncertain('odom', 'camera', SECOND)[1][:3, :3]
    np.testing.assert_allclose(turn @ np.diag(semi_axes ** 2) @ turn.T, 4.0 * told, atol=1e-9)


def test_what_is_certain_along_an_axis_is_a_thin_disc():
    semi_axes = of(robot(np.diag([0.04, 0.01, 0.0, 0.0, 0.0, 0.0])), 'camera').semi_axes
    np.testing.assert_allclose(semi_axes, [0.4e-3, 0.2, 0.4])


def test_it_is_that_of_the_moment():
    buffer = robot(np.diag([0.04, 0.01, 0.01, 0.0, 0.0, 0.0]))
    buffer.insert('odom', 'base', 2 * SECOND, Pose(), covariance=np.diag([0.05] * 3 + [0.0] * 3))
    then, now = of(buffer, 'camera'), of(buffer, 'camera', 2 * SECOND)
    np.testing.assert_allclose(then.semi_axes.max(), 0.4)
    np.testing.assert_allclose(now.semi_axes.max(), 2.0 * np.sqrt(0.04 + 0.05))


@pytest.mark.parametrize('frame', ['base', 'odom', 'nowhere'])
def test_there_is_none_where_the_position_is_certain_or_the_frame_unknown(frame):
    assert of(robot(np.eye(6)), frame) is None
    assert of(BufferCore(), frame) is None


def test_there_is_none_where_only_the_rotation_is_uncertain():
    assert of(robot(np.diag([0.0, 0.0, 0.0, 1e-4, 1e-4, 1e-4])), 'camera') is None
