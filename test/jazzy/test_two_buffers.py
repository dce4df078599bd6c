# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""tf2's buffer and ours on one live stream, in one process, give the same results."""

import json
from pathlib import Path
import subprocess

from programs import PATIENCE_S
import pytest

PROGRAM = Path(__file__).with_name('two_buffers.py')
ERRORS = {'LookupException', 'ConnectivityException', 'ExtrapolationException',
          'InvalidArgumentException'}


@pytest.fixture(scope='module')
def answers(env, start_for_all):
    """Return both results for a robot that one publisher of tf2 and one of ours publish."""
    robot = start_for_all('ros2', 'run', 'tf_tree_py', 'five_frame_publisher')
    start_for_all('ros2', 'run', 'tf2_ros', 'static_transform_publisher', '--x', '0.1',
                  '--frame-id', 'island', '--child-frame-id', 'palm')
    with subprocess.Popen(['python3', str(PROGRAM)], env=env, stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, text=True) as program:
        heard = program.stdout.readline()
        robot.interrupt()
        robot.end()
        output, _ = program.communicate('\n', timeout=2 * PATIENCE_S)
    assert (heard, program.returncode) == ('heard\n', 0), output
    return json.loads(output)


def is_error(answer):
    return isinstance(answer[0], str)


def test_there_are_answers_and_every_kind_of_error(answers):
    errors = {answer['theirs'][0] for answer in answers if is_error(answer['theirs'])}
    assert errors >= ERRORS
    assert sum(not is_error(answer['theirs']) for answer in answers) > 60


def test_numbers_are_the_same(answers):
    for answer in answers:
        theirs, ours = answer['theirs'], answer['ours']
        if is_error(theirs) or is_error(ours):
            continue
        if len(theirs) == 1:
            assert ours == theirs, answer['question']
        else:
            assert ours[:-4] == pytest.approx(theirs[:-4], abs=1e-9), answer['question']
            # A quaternion and its negative are one rotation.
            cosine = sum(a * b for a, b in zip(theirs[-4:], ours[-4:], strict=True))
            assert abs(cosine) == pytest.approx(1.0, abs=1e-12), answer['question']


def test_errors_are_of_the_same_class(answers):
    for answer in answers:
        theirs, ours = answer['theirs'], answer['ours']
        assert is_error(theirs) == is_error(ours), answer
        if is_error(theirs):
            # Ours may be of a subclass.
            assert theirs[0] in ours, answer
