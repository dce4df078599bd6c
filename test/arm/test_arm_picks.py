# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Three picks from the first image to the tray, and the effect of each mistake on one."""

import json
import sys

from examples.arm.mistakes import MISTAKES, RIGHT
from examples.arm.report import PLACED_WITHIN
from examples.arm.speeds import errors_at, law, RADIUS
from examples.arm.trial import run
from programs import completed
import pytest

SEED = 0


@pytest.mark.parametrize('number', [0, 9, 17])
def test_block_is_picked_and_placed(number):
    trial = run(number, SEED, RIGHT)
    assert trial.error < 0.003
    assert trial.picked and trial.placed, trial.remark
    assert trial.off < PLACED_WITHIN
    assert trial.remark == ''


@pytest.mark.parametrize(('mistake', 'least'), [
    ('latest', 0.03), ('frozen', 0.05), ('swapped', 0.5)])
def test_mistake_misses_the_block(mistake, least):
    trial = run(0, SEED, MISTAKES[mistake])
    assert trial.error > least
    assert not trial.picked and not trial.placed
    assert trial.remark


def test_error_of_the_latest_is_speed_times_latency():
    errors = errors_at(1.0)
    assert len(errors) >= 5
    for error in errors:
        assert error.stamped < 0.001
        assert error.latest == pytest.approx(law(RADIUS), rel=0.02)


def command(*arguments):
    return completed(sys.executable, '-m', 'examples.arm', *arguments)


def test_command_tells_counts_and_a_row_for_each_run():
    done = command('--runs', '1', '--seed', '3', '--json')
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told['seed'], told['runs'], told['picked'], told['placed']) == (3, 1, 1, 1)
    assert [row['run'] for row in told['rows']] == [0]
    assert told['detection_error_worst_m'] == told['rows'][0]['detection_error_m'] < 0.003


@pytest.mark.parametrize('arguments', [('--runs', '0'), ('--seed', '-1'), ('--mistake', 'none')])
def test_command_refuses_what_makes_no_sense(arguments):
    done = command(*arguments)
    assert done.returncode == 2
    assert arguments[0] in done.stderr and 'Traceback' not in done.stderr
