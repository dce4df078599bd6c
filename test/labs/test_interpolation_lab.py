# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Between samples: a T^2 / 8 on a curve, and invented poses at a jump."""

from functools import partial

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.labs.interpolation import between_samples, invented, rate_for
from tf_tree_py.labs.latency import pose_at


def test_fitted_law_is_an_eighth_of_acceleration_times_period_squared():
    numbers = report_of('interpolation').numbers
    assert numbers['factor'] == pytest.approx(0.125, rel=0.01)
    assert numbers['power'] == pytest.approx(2.0, rel=0.01)


def test_error_on_a_curve():
    for row in rows_of('interpolation'):
        law = 0.5 * row['turn_rate'] / row['rate_hz'] ** 2 / 8.0
        assert row['law_m'] == pytest.approx(law)
        assert row['moved_m'] == pytest.approx(law, rel=0.005)


def test_rotation_at_a_constant_rate_is_exact():
    assert all(row['turned_rad'] < 1e-7 for row in rows_of('interpolation'))


def test_rotation_that_changes_its_rate_is_not():
    for row in rows_of('interpolation', 1):
        assert 0.9 * row['law_rad'] < row['turned_rad'] < row['law_rad']


@pytest.mark.parametrize('speed, turn_rate', [(0.5, 0.5), (2.0, 1.0), (15.0, 4.0)])
def test_rule_of_thumb_keeps_its_promise(speed, turn_rate):
    rate = rate_for(speed * turn_rate, 0.001)
    motion = partial(pose_at, speed, turn_rate)
    assert between_samples(motion, rate).moved == pytest.approx(0.001, rel=0.01)
    assert between_samples(motion, 2.0 * rate).moved == pytest.approx(0.00025, rel=0.01)


def test_jump_invents_poses_halfway():
    assert [(round(one.from_before, 9), round(one.from_after, 9))
            for one in invented(sent_before=False)] == [
        (0.0, 0.5), (0.125, 0.375), (0.25, 0.25), (0.375, 0.125), (0.5, 0.0)]
    assert report_of('interpolation').numbers['invented_m'] == pytest.approx(0.25)


def test_old_pose_sent_again_just_before_the_jump_leaves_nothing_to_invent():
    assert [one.from_before for one in invented(sent_before=True)] == [0.0, 0.0, 0.0, 0.0, 0.5]
