# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The opposite direction is the inverse; one point shows when it is missing."""

from math import pi

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core import Pose
from tf_tree_py.labs.direction import CAMERA_P, is_in_front, robot_at


def test_only_the_inverse_puts_the_point_where_it_is():
    right, *wrong = rows_of('direction')
    assert right['error_m'] == pytest.approx(0.0, abs=1e-12)
    assert all(row['error_m'] > 1.0 for row in wrong) and len(wrong) == 3


def test_check_never_accuses_the_right_way():
    numbers = report_of('direction').numbers['the inverse']
    assert numbers['behind'] == numbers['other_range'] == 0.0


def test_one_point_finds_some_mistakes_and_the_distance_nearly_all():
    for row in rows_of('direction')[1:]:
        assert 0.3 < row['behind'] < 0.6
        assert row['other_range'] > 0.99


@pytest.mark.parametrize('yaw', [0.0, 1.0, pi / 2, 3.0, -2.0])
def test_what_a_camera_sees_is_in_front_of_the_robot(yaw):
    buffer = robot_at(Pose.from_xyz_rpy(3.0, -1.0, yaw=yaw))
    map_p = buffer.lookup('map', 'camera') @ CAMERA_P
    assert is_in_front(buffer.lookup('base_link', 'map'), map_p)
    behind = buffer.lookup('map', 'base_link') @ (-1.0, 0.2, 0.0)
    assert not is_in_front(buffer.lookup('base_link', 'map'), behind)


def test_optical_frame_looks_along_z():
    assert is_in_front(Pose(), (0.0, 0.0, 2.0), forward=(0.0, 0.0, 1.0))
    assert not is_in_front(Pose(), (2.0, 0.0, -1.0), forward=(0.0, 0.0, 1.0))
