# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The demo as a new user runs it, and the end of executables."""

import re
import subprocess

from programs import executable, PATIENCE_S
import pytest
from tf_tree_py.nodes import (
    buffer_server,
    five_frame_demo,
    five_frame_listener,
    five_frame_publisher,
    static_transform_publisher,
)


def test_demo_ends_by_itself_and_tells_how_near_the_answers_were(start):
    demo = start('five_frame_demo', '--seconds', '1.5', '--ros-args', '-p', 'rate_hz:=5')
    assert demo.end() == 0
    first, *_ = lines = demo.output.splitlines()
    assert "the pose of a moving robot's gripper in the world" in first
    assert sum('xyz' in line for line in lines) >= 3
    answered, asked = map(int, re.search(r'(\d+) of (\d+) lookups answered', demo.output).groups())
    assert 3 <= answered <= asked
    distance, angle = map(float, re.search(
        r'true motion: (\S+) mm, (\S+) deg', demo.output).groups())
    # An interpolation differs from the motion; see the bound in test_five_frame_publisher.
    assert 0.0 < distance < 10.0
    assert 0.0 < angle < 1.0
    assert ' 0 refused' in demo.output


def test_demo_survives_impatient_ctrl_c(start):
    demo = start('five_frame_demo')
    demo.wait_for('xyz')
    demo.interrupt_until_it_ends()
    assert demo.end() == 0
    assert 'lookups answered' in demo.output
    assert 'Traceback' not in demo.output


def test_reader_that_leaves_ends_the_demo_quietly():
    command = executable('five_frame_demo', '--ros-args', '-p', 'rate_hz:=20')
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as demo:
        assert demo.stdout.readline()
        demo.stdout.close()
        complaint = demo.stderr.read()
        assert demo.wait(PATIENCE_S) == 0
    assert complaint == ''


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['--seconds', 'x'], "argument --seconds: 'x' is not a number greater than zero"),
    (['--seconds', '0'], "argument --seconds: '0' is not a number greater than zero"),
    (['--second', '1'], 'unrecognized arguments: --second 1'),
])
def test_mistake_in_arguments_is_one_sentence(monkeypatch, capsys, arguments, sentence):
    monkeypatch.setattr(five_frame_demo, 'run', None)
    with pytest.raises(SystemExit) as ended:
        five_frame_demo.main(['five_frame_demo', *arguments])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told.startswith('five_frame_demo: ')
    assert sentence in told
    assert told.count('\n') == 1


def test_mistake_in_a_parameter_is_one_sentence(start):
    demo = start('five_frame_demo', '--ros-args', '-p', 'radius:=0')
    assert demo.end() == 2
    *_, told = demo.output.splitlines()
    assert told == ('five_frame_demo: parameter radius must be a number from 0.01 to 1000.0, '
                    'not 0')
    assert 'Traceback' not in demo.output


@pytest.mark.parametrize('module', [
    buffer_server, five_frame_demo, five_frame_listener, five_frame_publisher,
    static_transform_publisher])
def test_help_explains(capsys, module):
    with pytest.raises(SystemExit) as ended:
        module.main([module.NAME, '--help'])
    assert not ended.value.code
    told = capsys.readouterr().out
    assert told.startswith(f'usage: {module.NAME} ')
    assert any(verb in told for verb in ('Publishes', 'Prints', 'Shows', 'serves'))
    assert all(setting.meaning in told for setting in getattr(module, 'SETTINGS', ()))
