# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The golden example, its exercise, the wrong order, and the effect of a wrong rotation."""

from lab_reports import report_of, rows_of
import numpy as np
import pytest
from tf_tree_py.core import Pose
from tf_tree_py.labs.order import EXAMPLE, EXERCISE, LEFT_TURN, point, tree

LEFT, AHEAD = '(0.0, 1.0, 0.0)', '(1.0, 0.0, 0.0)'


def test_example_step_by_step():
    assert [row['origin_m'] for row in rows_of('order', 1)] == [
        '(2.0, 0.0, 0.0)', '(2.5, 1.0, 0.0)', '(2.7, 1.0, 0.8)', '(3.7, 1.0, 0.8)']
    assert point(EXAMPLE) == (3.7, 1.0, 0.8)


def test_exercise_step_by_step():
    *steps, seen = rows_of('order', 2)
    assert [row['origin_m'] for row in steps] == [
        '(2.0, 0.0, 0.0)', '(2.5, 1.0, 0.0)', '(2.5, 1.2, 0.8)']
    assert steps[-1]['forward'] == LEFT and seen['origin_m'] == '(2.5, 2.2, 0.8)'
    assert point(EXERCISE) == (2.5, 2.2, 0.8)


def test_there_and_back_is_the_identity():
    buffer = tree(EXERCISE)
    unit = buffer.lookup('map', 'camera') @ buffer.lookup('camera', 'map')
    assert np.allclose(unit.as_matrix(), np.eye(4), atol=1e-12)


def test_translations_hide_the_wrong_order_and_a_turn_shows_it():
    numbers = report_of('order').numbers
    assert numbers['example_wrong'] == numbers['example'] == (3.7, 1.0, 0.8)
    assert numbers['exercise'] == (2.5, 2.2, 0.8)
    assert numbers['exercise_wrong'] == (0.7, 4.0, 0.8)


def test_turn_then_go_is_not_go_then_turn():
    go = Pose(1.0)
    assert (LEFT_TURN @ go).translation == pytest.approx((0.0, 1.0, 0.0))
    assert (go @ LEFT_TURN).translation == pytest.approx((1.0, 0.0, 0.0))


def test_each_wrong_edge_has_a_symptom_of_its_own():
    none, map_odom, odom_base, base_camera = (
        (row['base_in_odom'], row['base_in_map'], row['camera_in_base'])
        for row in rows_of('order', 4))
    assert len({none, map_odom, odom_base, base_camera}) == 4
    assert none == (AHEAD, AHEAD, AHEAD)
    assert map_odom[:2] == (AHEAD, LEFT)
    assert odom_base[0] == LEFT and odom_base[2] == AHEAD
    assert base_camera[1:] == (AHEAD, LEFT)
