# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The simulated arm over DDS: its process, its node, the tree of its URDF, and perception."""

import json
import os
from pathlib import Path
import sys

from programs import completed
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PYTHON = Path(os.environ.get('TF_TREE_PY_WORKSPACE', REPOSITORY / '.workspace'), 'arm/bin/python')


def command(*arguments, python=PYTHON):
    environment = os.environ | {
        'TF_TREE_PY_ARM_PYTHON': str(python),
        'PYTHONPATH': os.pathsep.join(filter(None, (str(REPOSITORY),
                                                    os.environ.get('PYTHONPATH'))))}
    return completed(sys.executable, '-m', 'examples.arm.ros', *arguments, env=environment)


def test_block_is_picked_by_the_stamp_of_an_image_over_dds():
    if not PYTHON.exists():
        pytest.skip('scripts/arm has made no venv with PyBullet here')
    done = command('--runs', '1', '--json')
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told['picked'], told['placed']) == (1, 1), done.stdout + done.stderr
    assert told['detection_error_worst_m'] < 0.003


def test_without_pybullet_it_says_what_to_run():
    done = command(python=REPOSITORY / 'no' / 'python')
    assert done.returncode == 2
    assert 'scripts/arm --ros' in done.stderr and 'Traceback' not in done.stderr


def test_arm_that_cannot_start_is_told():
    done = command(python=sys.executable)  # it has no PyBullet
    assert done.returncode == 2
    assert 'the process of the arm' in done.stderr
