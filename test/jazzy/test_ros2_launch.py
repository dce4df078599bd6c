# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The launch files with ``ros2 launch``; our nodes replace tf2's in launch files."""

from pathlib import Path
import textwrap

import pytest

FILES = sorted(path.name for path in (Path(__file__).parents[2] / 'launch').glob('*.launch.py'))

XML = """
    <launch>
      <arg name="child" default="camera"/>
      <node pkg="tf_tree_py" exec="static_transform_publisher" name="mounted"
            args="--x 0.2 --z 0.8 --frame-id base_link --child-frame-id $(var child)"/>
      <node pkg="tf_tree_py" exec="static_transform_publisher"
            args="0.1 0 0 0 0 0 base_link lidar"/>
      <node pkg="tf_tree_py" exec="buffer_server" namespace="robot" output="screen">
        <param name="buffer_size" value="30.0"/>
        <remap from="tf2_frames" to="frames"/>
      </node>
    </launch>
"""
YAML = """
    launch:
    - node:
        pkg: tf_tree_py
        exec: static_transform_publisher
        name: from_yaml
        args: --x 0.5 --frame-id base_link --child-frame-id gps
"""


@pytest.fixture
def frontend(run):
    """Skip where the installed launch has no grammar, so that it can only read Python."""
    done = run('python3', '-c', 'from launch.frontend.parse_substitution import *; '
                                'from pathlib import Path; '
                                'print(Path(get_grammar_path()).is_file())')
    assert done.returncode == 0, done.stderr
    if done.stdout.strip() != 'True':
        pytest.skip('the installed launch cannot read XML or YAML: its grammar.lark is missing')


def ended_cleanly(program):
    program.interrupt()
    assert program.end() == 0, program.output
    assert 'Traceback' not in program.output and '[ERROR]' not in program.output
    return True


@pytest.mark.parametrize('name', FILES)
def test_arguments_are_shown(output_of, name):
    output = output_of('launch', 'tf_tree_py', name, '--show-args')
    for argument in ('params_file', 'use_sim_time', 'namespace'):
        assert f"'{argument}':" in output


def test_publisher_by_its_launch_file(start, await_output):
    program = start('ros2', 'launch', 'tf_tree_py', 'five_frame_publisher.launch.py',
                    'namespace:=robot1')
    await_output('(?m)^/robot1/five_frame_publisher$', 'node', 'list')
    # The topics are the same in every namespace.
    await_output('child_frame_id: ', 'topic', 'echo', '--once', '/tf')
    assert ended_cleanly(program)


def test_listener_by_its_launch_file(start, await_output):
    program = start('ros2', 'launch', 'tf_tree_py', 'five_frame_listener.launch.py',
                    'use_sim_time:=true')
    program.wait_for('The pose of gripper in world')
    await_output('Boolean value is: True', 'param', 'get', '/five_frame_listener', 'use_sim_time')
    assert ended_cleanly(program)


def test_both_by_one_launch_file(start):
    program = start('ros2', 'launch', 'tf_tree_py', 'five_frames.launch.py')
    program.wait_for('xyz', count=3)
    assert ended_cleanly(program)


def test_xml_takes_our_programs_where_it_took_those_of_tf2(
        frontend, start, await_output, tmp_path):
    file = tmp_path / 'robot.launch.xml'
    file.write_text(textwrap.dedent(XML).strip())
    program = start('ros2', 'launch', str(file), 'child:=front_camera')
    program.wait_for('base_link -> front_camera')
    program.wait_for('Old-style arguments are deprecated')
    for node in ('/robot/tf_buffer', '/mounted'):
        await_output(f'(?m)^{node}$', 'node', 'list')
    await_output('Double value is: 30.0', 'param', 'get', '/robot/tf_buffer', 'buffer_size')
    await_output('front_camera(.|\n)*lidar|lidar(.|\n)*front_camera',
                 'service', 'call', '/robot/frames', 'tf2_msgs/srv/FrameGraph')
    assert ended_cleanly(program)


def test_yaml_takes_them_too(frontend, start, await_output, tmp_path):
    file = tmp_path / 'robot.launch.yaml'
    file.write_text(textwrap.dedent(YAML).strip())
    program = start('ros2', 'launch', str(file))
    await_output('child_frame_id: gps', 'topic', 'echo', '--once', '/tf_static')
    await_output('(?m)^/from_yaml$', 'node', 'list')
    assert ended_cleanly(program)


def test_launch_ends_with_a_program_that_refuses_its_parameters(start, tmp_path):
    file = tmp_path / 'wrong.yaml'
    file.write_text('/**: {ros__parameters: {radius: -1.0}}')
    program = start('ros2', 'launch', 'tf_tree_py', 'five_frame_publisher.launch.py',
                    f'params_file:={file}')
    program.end()
    program.wait_for('five_frame_publisher: parameter radius must be a number')
    assert 'Traceback' not in program.output
