# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_audit: the lookups of any program, by its lines of code."""

import json
import sys

import pytest
from tool_helpers import assert_one_sentence, assert_shape, tool

PROGRAM = """
from tf_tree_py import BufferCore, Pose, TransformException
buffer = BufferCore()
for tick in range(201):
    buffer.insert('odom', 'base', 10**9 + tick * 10**7, Pose(x=tick * 0.01))

def on_image():
    return buffer.lookup('odom', 'base')

def right():
    return buffer.lookup('odom', 'base', 2 * 10**9)
"""


def audit(folder, ending, *arguments):
    file = folder / 'program.py'
    file.write_text(PROGRAM + ending)
    return tool('tf_audit', *arguments, '--', sys.executable, file)


def test_line_that_asks_for_the_latest_is_told_with_what_it_cost(tmp_path):
    done = audit(tmp_path, 'on_image(); on_image(); right()')
    assert done.returncode == 1
    told = ' '.join(done.stdout.split())
    assert 'program.py:8 on_image odom <- base: asked for the latest, twice' in told
    assert 'moved at most 10.00 cm and 0.00 deg in 100 ms: that is what 100 ms cost' in told
    assert 'program.py:11 right odom <- base: asked for a stamp, once' in told


def test_json_has_the_documented_shape_and_right_lines_are_fine(tmp_path):
    done = audit(tmp_path, 'right()', '--json')
    assert done.returncode == 0
    report = json.loads(done.stdout)
    assert_shape(report, 'tools', '### The audit')
    line, = report['lines']
    assert_shape(line, 'tools', '### A line of code')
    assert line['caller'] == {'file': str(tmp_path / 'program.py'), 'line': 11,
                              'function': 'right'}
    assert not line['doubtful']


def test_failed_lookup_is_doubtful(tmp_path):
    done = audit(tmp_path, """
try:
    buffer.lookup('odom', 'nowhere')
except TransformException:
    pass
""")
    assert done.returncode == 1
    assert 'once, 1 failed' in done.stdout


def test_program_that_fails_is_told_behind_its_audit(tmp_path):
    done = audit(tmp_path, 'right(); raise SystemExit(3)')
    assert done.returncode == 2
    assert 'right' in done.stdout
    assert done.stderr == 'tf_audit: the program ended with status 3\n'


@pytest.mark.parametrize('command, sentence', [
    (['--', sys.executable, '-c', 'pass'], 'created no buffer'),
    (['--', sys.executable, '-c', PROGRAM], 'looked up nothing'),
    (['--', '/nowhere/at/all'], 'No such file'),
    (['--'], 'no command to run'), ([], 'no command to run'),
    (['node.py'], 'node.py')])
def test_what_cannot_be_audited_is_one_sentence(command, sentence):
    assert_one_sentence(tool('tf_audit', *command), 'tf_audit', sentence)
