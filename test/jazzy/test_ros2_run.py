# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every executable by ``ros2 run``, until Ctrl-C."""

from importlib.metadata import distribution
from pathlib import Path

import pytest

CONFIG = Path(__file__).parents[2] / 'config'
ROBOT = ['--urdf', str(CONFIG / 'five_frames.urdf')]
FRAMES = ['--frame-id', 'map', '--child-frame-id', 'odom']
# The arguments, the output to wait for, a line, and the ros2 command whose output has it.
LONG_LIVED = {
    'buffer_server': ([], None, ('/tf2_frames', 'service', 'list')),
    'edge_switch': ([], None, ('/edge_switch/switch_to/vo', 'service', 'list')),
    'five_frame_demo': ([], 'xyz', None),
    'five_frame_listener': ([], 'waiting for world -> gripper', None),
    'five_frame_publisher': (
        ['--ros-args', '--params-file', str(CONFIG / 'five_frames.yaml')], None,
        ('/tf', 'topic', 'list')),
    'relocalisation_anchor': ([], None, ('/pose', 'topic', 'list')),
    'robot_state_publisher': (ROBOT, "<Robot 'five_frames'", None),
    'static_transform_publisher': (
        FRAMES, 'Spinning until stopped', ('/tf_static', 'topic', 'list')),
    'tf_relay': (['--ros-args', '-r', '__ns:=/robot1'], '/robot1/tf -> /tf', None),
    'tf_share': ([], 'Sharing /tf and /tf_static of domain', ('/tf_share', 'node', 'list')),
    'urdf_broadcaster': (
        ROBOT, "<Robot 'five_frames'", ('/robot_description', 'topic', 'list')),
}
SHORT_LIVED = {'tf_lab': (['order', '--json'], '"law"')}
# test/tools tests these; those with verbs of ros2 are in test_ros2_verbs.
TOOLS = dict.fromkeys((
    'tf_archive', 'tf_audit', 'tf_calibrate', 'tf_doctor', 'tf_echo', 'tf_export', 'tf_frames',
    'tf_monitor', 'tf_record', 'tf_view', 'view_frames'))


def test_all_are_listed_and_tried(output_of):
    output = output_of('pkg', 'executables', 'tf_tree_py')
    listed = {line.split()[1] for line in output.splitlines()}
    entries = distribution('tf_tree_py').entry_points.select(group='console_scripts')
    assert listed == {entry.name for entry in entries} == (
        LONG_LIVED.keys() | SHORT_LIVED.keys() | TOOLS.keys())


@pytest.mark.parametrize('name', LONG_LIVED)
def test_it_runs_until_ctrl_c(start, await_output, wait_until_gone, name):
    words, said, shown = LONG_LIVED[name]
    if shown:
        line, *command = shown
        wait_until_gone(f'(?m)^{line}$', *command)
    program = start('ros2', 'run', 'tf_tree_py', name, *words)
    if said:
        program.wait_for(said)
    if shown:
        await_output(f'(?m)^{line}$', *command)
    program.interrupt()
    assert program.end() == 0, program.output
    assert 'Traceback' not in program.output


@pytest.mark.parametrize('name', SHORT_LIVED)
def test_it_runs_to_its_end(ros2, name):
    words, said = SHORT_LIVED[name]
    done = ros2('run', 'tf_tree_py', name, *words)
    assert (done.returncode, done.stderr) == (0, '')
    assert said in done.stdout


@pytest.mark.parametrize('name', [*LONG_LIVED, *SHORT_LIVED, *TOOLS])
def test_help_comes_through(ros2, name):
    done = ros2('run', 'tf_tree_py', name, '--help')
    assert done.returncode == 0
    assert done.stdout.startswith('usage: ')


def test_mistake_is_one_sentence_and_a_status(ros2):
    done = ros2('run', 'tf_tree_py', 'tf_relay')
    assert done.returncode == 2
    assert 'the relay would receive its own output' in done.stderr
    assert 'Traceback' not in done.stderr
