# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The robot of ``benchmark.oracle``, its localiser, and what it shows in a few drives."""

from functools import cache
from pathlib import Path
import re

from benchmark.oracle import __main__ as command, judge, localiser, robot, tables
from benchmark.oracle.drive import AGREEING, DRIVE, drive, Judged, JUMPING, off, Setting
from inputs import for_each
import numpy as np
from scipy.linalg import expm
from scipy.stats import chi2

PAGE = Path(__file__).parents[2] / 'docs' / 'oracle.md'
RATE_HZ, SEEDS = 5.0, 2
# Their mean over so few drives says nothing yet.
STATISTICS = ('NEES', 'good sightings refused')


@cache
def drives(planar):
    """Return the setting and the records of a few drives."""
    setting = Setting(planar, RATE_HZ, robot.Wheels(), (0.031, 0.0145))
    return setting, judge.Drives(*([drive(setting, story, seed) for seed in range(SEEDS)]
                                   for story in (DRIVE, AGREEING, JUMPING)))


def test_truth_is_the_exponential_of_a_constant_twist():
    velocities = np.array([0.7, 0.1, -0.2, 0.3, -0.1, 0.4])
    x, y, z, a, b, c = velocities
    generator = np.array([[0, -c, b, x], [c, 0, -a, y], [-b, a, 0, z], [0, 0, 0, 0]])
    seconds = 12.0
    steps = robot.steps_of(np.tile(velocities, (round(seconds * robot.FINE_HZ), 1)))
    end, expected = robot.added_up(steps)[-1], expm(seconds * generator)
    np.testing.assert_allclose(end.positions, expected[:3, 3], atol=1e-5)
    np.testing.assert_allclose(end.rotations.as_matrix(), expected[:3, :3], atol=1e-9)


@for_each(planar=[True, False])
def test_sightings_are_off_as_they_say_and_late(planar):
    rng = np.random.default_rng(3)
    fine = robot.driven(rng, 100.0, planar, robot.Wheels()).fine
    seen = localiser.sightings(rng, fine, 30.0, planar, outage=(20.0, 30.0))
    first = [one for one in seen if one.first]
    assert len(first) == 90 * 30 and 0.05 < len(seen) / len(first) - 1.0 < 0.15
    assert 0.03 < np.mean([not one.good for one in first]) < 0.07
    assert not [one for one in seen if 20.0 <= one.stamp * 1e-9 < 30.0]
    late = np.array([one.arrival - one.stamp for one in first]) * 1e-9
    assert 0.05 <= late.min() < 0.06 and 0.29 < late.max() <= 0.3
    assert any(one.stamp < before.stamp for before, one in zip(seen, seen[1:], strict=False))
    which = [0, 1, 5] if planar else range(6)
    squares = []
    for one in first:
        truth = fine[round(one.stamp * 1e-9 * robot.FINE_HZ)]
        error = off(robot.motion_of(one.pose), truth)
        if one.good:
            squares.append(error[which] @ np.linalg.solve(
                one.covariance[np.ix_(which, which)], error[which]))
        else:
            assert np.linalg.norm(error[:3]) > 0.3
    low, high = chi2.ppf((0.001, 0.999), len(which) * len(squares)) / len(squares)
    assert low < np.mean(squares) < high


def test_outliers_of_a_burst_see_one_wrong_map():
    rng = np.random.default_rng(4)
    fine = robot.driven(rng, 20.0, False, robot.Wheels()).fine
    seen = [one for one in localiser.sightings(
        rng, fine, 30.0, False, bursts=(localiser.Burst(10.0, 13.0, 1.0),))
        if one.first and 10.0 <= one.stamp * 1e-9 < 13.0]
    assert len(seen) == 90 and not any(one.good for one in seen)
    truth = fine[[round(one.stamp * 1e-9 * robot.FINE_HZ) for one in seen]]
    wrong = truth.inverse().after(robot.motion_of([one.pose for one in seen]))
    turned = (wrong.rotations[0].inv() * wrong.rotations).magnitude()
    assert wrong.rotations[0].magnitude() > 0.2 and np.quantile(turned, 0.9) < 0.2


@for_each(planar=[True, False])
def test_promises_hold_that_need_no_statistics(planar):
    setting, records = drives(planar)
    rows = judge.rows_of(records)
    assert len(rows) > 20
    assert not [row for row in rows if not (row.good or row.name.startswith(STATISTICS))]


@for_each(factor=[0.7, 1.0, 1.5])
def test_judge_finds_covariances_of_a_wrong_size(factor):
    rng = np.random.default_rng(5)
    _, records = drives(True)
    judged = [[Judged(*factor * rng.chisquare(3, 2) / 3.0) for _ in DRIVE.judged]
              for _ in range(100)]
    rows = list(judge.consistency([records.usual[0]._replace(judged=each) for each in judged]))
    assert [row.good for row in rows] == 3 * [factor == 1.0]


def test_judge_finds_what_is_wrong():
    setting, records = drives(True)
    one = records.usual[0]
    jumped = one.published.copy()
    jumped[2000:, 0] += 0.05
    late, far = one.estimated.copy(), one.read.copy()
    late[:, :2] += 0.3
    verdicts = [(seen, verdict._replace(accepted=True)) for seen, verdict in one.verdicts]
    for wrong, names in (
            ({'published': jumped}, {'largest speed of the edge at the robot, m/s',
                                     'largest step there in 20 ms, mm'}),
            ({'estimated': late}, {'outage: estimate right, s', 'kidnapping: estimate right, s'}),
            ({'read': far + [5, 0, 0, 0, 0, 0, 0]}, {'outage: published pose right, s'}),
            ({'answers': (1000, 1)}, {'lookups whose answer changed later'}),
            ({'verdicts': verdicts}, {'outliers accepted'})):
        rows = judge.rows_of(records._replace(usual=[one._replace(**wrong)] * 3))
        assert names <= {row.name for row in rows if not row.good}


def test_page_has_the_rows_of_the_command_and_all_are_good():
    setting, records = drives(True)
    text = tables.table([setting], [judge.rows_of(records)], SEEDS)
    page = PAGE.read_text()
    for where in ('### In the plane\n', '### In space\n'):
        part = page.partition(where)[2].partition('\n#')[0]
        assert _names(part) == _names(text) and '**' not in part.partition('| --- |')[2]


def _names(text):
    return re.findall(r'^\| (\w[^|]*) \|', text, re.MULTILINE)


def test_command_prints_both_tables_and_its_status_says_whether_all_is_good(capsys):
    status = command.main(['--seeds', '2', '--rates', '1'])
    said = capsys.readouterr().out
    assert '### In the plane' in said and '### In space' in said
    assert (status, '**' in said) in ((0, False), (1, True))
