# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Between poses: powers of the time between them, the effect of noise, ringing at a jump."""

from lab_reports import report_of, rows_of
import pytest


def test_error_between_poses_falls_with_the_powers_that_are_told():
    powers = report_of('continuous').numbers['powers']
    assert powers['straight_m'] == pytest.approx(2.0, abs=0.1)
    assert powers['straight_rad'] == pytest.approx(2.0, abs=0.1)
    assert powers['spline_m'] == pytest.approx(4.0, abs=0.2)
    assert 3.0 < powers['spline_rad'] < 3.6


def test_spline_is_better_at_every_rate_where_the_motion_is_smooth():
    rows = rows_of('continuous')
    assert [row['rate_hz'] for row in rows] == [10, 20, 50, 100, 200]
    assert all(row['spline_px'] < 0.1 * row['straight_px'] for row in rows)
    by_rate = {row['rate_hz']: row for row in rows}
    assert by_rate[200]['straight_px'] < 0.1 < by_rate[100]['straight_px']
    assert by_rate[20]['spline_px'] < 0.13


def test_noise_is_averaged_by_few_knots_and_not_by_many():
    straight, five, ten, twenty, fifty, as_many = rows_of('continuous', 1)
    assert twenty['turned_rad'] < 0.4 * straight['turned_rad']
    assert twenty['turning'] < 0.05 * straight['turning']
    assert as_many['moved_m'] > straight['moved_m']
    assert five['moved_m'] > 0.05


def test_jump_rings_by_a_quarter_a_knot():
    ringing = [row['spline_jump_m'] for row in rows_of('continuous', 2)][1:]
    assert ringing[0] == pytest.approx(0.054, abs=0.001)
    for one, next_one in zip(ringing, ringing[1:], strict=False):
        assert next_one / one == pytest.approx(2.0 - 3.0**0.5, rel=0.01)
    assert all(row['straight_jump_m'] == 0.0 for row in rows_of('continuous', 2)[1:])
    assert rows_of('continuous', 2)[0]['spline_contact_m'] == pytest.approx(8.5e-4, abs=1e-5)
