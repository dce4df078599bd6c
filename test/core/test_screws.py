# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Twists and wrenches, transformed between frames."""

import math

from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import poses
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import adjoint, carry

screws = st.tuples(*[st.floats(-100.0, 100.0, allow_subnormal=False)] * 6)


def skew(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@given(poses, screws)
def test_adjoint_is_the_matrix_of_carry(pose, screw):
    rotation = np.array(so3.as_matrix(pose[3:]))
    matrix = np.block([[rotation, skew(pose[:3]) @ rotation], [np.zeros((3, 3)), rotation]])
    reach = 1.0 + math.hypot(*pose[:3])
    assert carry(pose, screw) == pytest.approx(matrix @ screw, abs=1e-12 * reach * 200)
    assert adjoint(pose) == pytest.approx(matrix, abs=1e-14 * reach)


@given(poses, poses, screws)
def test_carrying_twice_is_carrying_by_the_product(a_T_b, b_T_c, screw):
    reach = (1.0 + math.hypot(*a_T_b[:3])) * (1.0 + math.hypot(*b_T_c[:3]))
    once = carry(se3.compose(a_T_b, b_T_c), screw)
    assert carry(a_T_b, carry(b_T_c, screw)) == pytest.approx(once, abs=1e-11 * reach)


@given(poses, screws, screws)
def test_the_power_of_a_wrench_is_the_same_in_every_frame(pose, twist, wrench):
    def power(twist, wrench):
        return float(np.dot(twist[:3], wrench[3:]) + np.dot(twist[3:], wrench[:3]))

    reach = 1.0 + math.hypot(*pose[:3])
    assert power(carry(pose, twist), carry(pose, wrench)) == pytest.approx(
        power(twist, wrench), abs=1e-9 * reach)
