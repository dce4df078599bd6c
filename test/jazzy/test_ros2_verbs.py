# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tools as verbs of the ros2 command, with the same arguments as the tools alone."""

import pytest

VERBS = ('archive', 'audit', 'doctor', 'echo', 'export', 'frames', 'monitor', 'record')


def test_verbs_are_listed_with_what_they_do(output_of):
    assert 'Inspect the transform tree' in output_of('--help')
    listed = output_of('tf')
    assert all(verb in listed for verb in VERBS)
    assert 'Print the pose of one frame in another' in listed


@pytest.mark.parametrize('verb', VERBS)
def test_help_is_that_of_the_tool(output_of, verb):
    output = output_of('tf', verb, '--help')
    assert output.startswith(f'usage: tf_{verb} ')
    assert 'examples:' in output


def test_verb_sees_a_robot(start, ros2):
    start('ros2', 'run', 'tf_tree_py', 'five_frame_publisher', '--ros-args', '-r', '/tf:=/r1/tf',
          '-r', '/tf_static:=/r1/tf_static')
    done = ros2('tf', 'echo', 'world', 'gripper', '--once', '--seconds', '50',
                '--tf-topic', '/r1/tf', '--ros-args', '-r', '/tf_static:=/r1/tf_static')
    assert (done.returncode, done.stdout.count('xyz')) == (0, 1), done.stderr


def test_status_and_sentence_come_through(ros2):
    done = ros2('tf', 'echo', '/map', 'base')
    assert done.returncode == 2
    assert "tf_echo: argument TARGET: '/map' begins with a slash" in done.stderr
    audit = ros2('tf', 'audit', '--json', '--', 'false')
    assert (audit.returncode, audit.stderr) == (2, 'tf_audit: the program ended with status 1\n')
