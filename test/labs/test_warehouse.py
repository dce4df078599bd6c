# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The forklift: 4 cm and 3.2 cm at right angles, nothing at rest, and the line that caused it."""

from math import degrees, hypot

from lab_reports import report_of, rows_of
import pytest


def by_scene_and_way():
    return {(row['scene'], row['way']): row for row in rows_of('warehouse')}


def test_translation_and_rotation_of_the_text():
    numbers = report_of('warehouse').numbers
    assert numbers['translation_m'] == pytest.approx(0.040, rel=0.01)
    assert numbers['rotation_m'] == pytest.approx(0.16 * 2.5 * 0.080, rel=0.01)


def test_the_two_are_at_right_angles():
    numbers = report_of('warehouse').numbers
    assert numbers['together_m'] == pytest.approx(hypot(0.040, 0.032), rel=0.01)
    assert numbers['sum_m'] == pytest.approx(0.072, rel=0.01)
    assert numbers['delay_for_8cm_s'] == pytest.approx(0.125, rel=0.01)
    curve = by_scene_and_way()['on a curve', 'now']
    assert (curve['ahead_m'], curve['left_m']) == (
        pytest.approx(0.040, abs=5e-4), pytest.approx(0.032, abs=5e-4))
    assert degrees(curve['turned_rad']) == pytest.approx(degrees(0.16 * 0.080), rel=0.01)


def test_standing_all_ways_are_right():
    assert all(row['off_m'] < 1e-12 for row in rows_of('warehouse') if row['scene'] == 'standing')


def test_moving_only_the_header_stamp_is_right():
    for (scene, way), row in by_scene_and_way().items():
        if scene == 'standing':
            continue
        if way == "header's stamp":
            assert row['off_m'] < 1e-4 < 0.01
        else:
            assert row['off_m'] > 0.025


def test_audit_tells_the_three_lines_apart_and_what_each_costs():
    now, latest, stamped = rows_of('warehouse', 1)
    assert [row['line'] for row in (now, latest, stamped)] == [
        '_when_it_is_processed()', '_the_latest()', '_when_it_was_taken()']
    assert [row['asked_for'] for row in (now, latest, stamped)] == ['a stamp', 'latest', 'a stamp']
    assert now['moved_m'] == pytest.approx(0.04, rel=0.01)
    assert degrees(now['turned_rad']) == pytest.approx(0.73, abs=0.01)
    assert now['apart_s'] == pytest.approx(0.080) and stamped['apart_s'] == 0.0
    assert 0.060 < latest['apart_s'] < 0.080 and latest['behind_newest_s'] == 0.0
    assert stamped['moved_m'] < 1e-9
    assert stamped['behind_now_s'] == pytest.approx(0.080)
