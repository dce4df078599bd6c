# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A table of what users of a stock Jazzy do with nodes, applied to ours.

Parameters from YAML files and by ``ros2 param set``, namespaces, simulated time, overrides of QoS
profiles, remappings in launch files, and our tools together with C++ publishers.
"""

from pathlib import Path
import re
import textwrap
import time

from programs import PATIENCE_S
import pytest

DESCRIPTION = str(Path(__file__).parents[2] / 'config' / 'five_frames.urdf')

# The words after an executable's name; its node; a parameter, its line in YAML, the output for
# it, and another value.
PARAMETERS = {
    'buffer_server': (
        [], 'tf_buffer', 'buffer_size', 'buffer_size: 30', 'Double value is: 30.0', '40.0'),
    'edge_switch': (
        [], 'edge_switch', 'prefer', 'prefer: [wheel, vo]', "values are: .*'wheel', 'vo'", '[vo]'),
    'five_frame_listener': (
        [], 'five_frame_listener', 'source_frame', 'source_frame: palm', 'String value is: palm',
        'lens'),
    'five_frame_publisher': (
        [], 'five_frame_publisher', 'radius', 'radius: 1.5', 'Double value is: 1.5', '2.5'),
    'relocalisation_anchor': (
        [], 'relocalisation_anchor', 'planar', 'planar: true', 'Boolean value is: True', 'false'),
    'tf_relay': (
        [], 'tf_relay', 'rates.odom', 'rates: {odom: 5}', 'Double value is: 5.0', '6.0'),
    'tf_share': (
        [], 'tf_share', 'buffer_size', 'buffer_size: 30', 'Double value is: 30.0', '40.0'),
    'urdf_broadcaster': (
        ['--urdf', DESCRIPTION], 'urdf_broadcaster', 'publish_frequency', 'publish_frequency: 7',
        'Double value is: 7.0', '9.0'),
}
# Executables whose parameter may change at run time; those of the others are read-only.
CHANGEABLE = {'urdf_broadcaster'}

CLOCK = """
import threading
import rclpy
from rosgraph_msgs.msg import Clock
rclpy.init()
node = rclpy.create_node('simulation')
publisher = node.create_publisher(Clock, '/clock', 1)
message = Clock()
message.clock.sec = 100
def tick():
    message.clock.nanosec = (message.clock.nanosec + 20_000_000) % 1_000_000_000
    message.clock.sec += message.clock.nanosec == 0
    publisher.publish(message)
node.create_timer(0.02, tick)
rclpy.spin(node)
"""

LAUNCH = """
from launch import LaunchDescription
from launch_ros.actions import Node

def generate_launch_description():
    own = [('/tf', 'tf'), ('/tf_static', 'tf_static')]
    return LaunchDescription([
        Node(package='tf_tree_py', executable=name, namespace='robot2', remappings=own,
             output='screen', parameters=[{'frame_prefix': 'r2/'}])
        for name in ('five_frame_publisher', 'five_frame_listener')])
"""


@pytest.mark.parametrize('executable', PARAMETERS)
def test_yaml_namespace_and_param_set(start, ros2, await_output, tmp_path, executable):
    words, node, name, line, shown, other = PARAMETERS[executable]
    file = tmp_path / 'parameters.yaml'
    file.write_text(f'/robot1/{node}:\n  ros__parameters:\n    {line}\n')
    program = start('ros2', 'run', 'tf_tree_py', executable, *words, '--ros-args',
                    '-r', '__ns:=/robot1', '--params-file', str(file))
    place = f'/robot1/{node}'
    await_output(shown, 'param', 'get', place, name)
    done = ros2('param', 'set', place, name, other)
    output = done.stdout + done.stderr
    assert ('Set parameter successful' if executable in CHANGEABLE else 'read-only') in output
    await_output(other if executable in CHANGEABLE else shown, 'param', 'get', place, name)
    # rclpy's own parameter, which every node has.
    assert 'Set parameter successful' in ros2('param', 'set', place, 'use_sim_time', 'true').stdout
    program.interrupt()
    assert program.end() == 0, program.output
    assert 'Traceback' not in program.output


def test_stamps_follow_use_sim_time_while_a_node_runs(start, await_output):
    start('python3', '-c', CLOCK)
    start('ros2', 'run', 'tf_tree_py', 'five_frame_publisher', '--ros-args',
          '-p', 'use_sim_time:=true', '-r', '/tf:=/tf_of_sim_time')
    echo = 'topic', 'echo', '--once', '/tf_of_sim_time'
    await_output(r'sec: [1-9]\d\d\n', *echo)
    await_output('successful', 'param', 'set', '/five_frame_publisher', 'use_sim_time', 'false')
    await_output(r'sec: \d{10}\n', *echo)


@pytest.mark.parametrize('package', ['tf2_ros', 'tf_tree_py'])
def test_publisher_takes_qos_overrides(start, await_output, package):
    topic = f'/tf_static_of_{package}'
    start('ros2', 'run', package, 'static_transform_publisher', '--frame-id', 'a',
          '--child-frame-id', 'b', '--ros-args', '-r', f'/tf_static:={topic}',
          '-p', f'qos_overrides.{topic}.publisher.reliability:=best_effort')
    await_output('Reliability: BEST_EFFORT', 'topic', 'info', '--verbose', topic)


@pytest.mark.parametrize('package', ['tf2_ros', 'tf_tree_py'])
def test_listener_takes_qos_overrides(start, await_output, package):
    topic = f'/tf_of_{package}'
    start('ros2', 'run', package, 'buffer_server', '--ros-args', '-r', f'/tf:={topic}',
          '-p', f'qos_overrides.{topic}.subscription.reliability:=best_effort')
    await_output('Reliability: BEST_EFFORT', 'topic', 'info', '--verbose', topic)


def test_launch_file_remaps_the_topics_into_a_namespace(start, await_output, tmp_path):
    file = tmp_path / 'robot2.launch.py'
    file.write_text(textwrap.dedent(LAUNCH))
    program = start('ros2', 'launch', str(file))
    program.wait_for('xyz')
    await_output(r'(?s)Node name: five_frame_publisher\n.*Subscription count: 1\n',
                 'topic', 'info', '--verbose', '/robot2/tf')
    program.interrupt()
    assert program.end() == 0, program.output


@pytest.fixture(scope='module')
def two_kinds(start_for_all, await_output):
    """Start our robot, and a C++ publisher that adds a camera to it."""
    start_for_all('ros2', 'run', 'tf_tree_py', 'five_frame_publisher')
    start_for_all('ros2', 'run', 'tf2_ros', 'static_transform_publisher', '--x', '0.25',
                  '--frame-id', 'gripper', '--child-frame-id', 'lens', '--ros-args',
                  '-r', '__node:=mounted_by_cpp')
    for name in ('five_frame_publisher', 'mounted_by_cpp'):
        await_output(f'(?m)^/{name}$', 'node', 'list')


@pytest.mark.parametrize(('words', 'expected'), [
    (('echo', 'gripper', 'lens', '--once', '--seconds', '60'), r'xyz\W+0\.250'),
    (('frames', '--seconds', '3', '--json'), 'mounted_by_cpp'),
    (('monitor', '--seconds', '3', '--json'), '"lens"'),
    (('doctor', '--seconds', '3', '--json'), r'"version": \d'),
], ids=['echo', 'frames', 'monitor', 'doctor'])
def test_tool_sees_what_a_cpp_node_publishes(two_kinds, await_output, words, expected):
    # On a busy machine, a tool that listens for some seconds may end before the discovery.
    assert 'Traceback' not in await_output(expected, 'tf', *words).stderr


def edges_in(file):
    return set(re.findall(r'"(\w+)" -> "(\w+)"', file.read_text()))


def drawn(run, file, *command):
    """Return the edges that a tool draws; it listens for five seconds, which may be too short."""
    edges, end = set(), time.monotonic() + PATIENCE_S
    while len(edges) < 5 and time.monotonic() < end:
        done = run(*command)
        assert 'Traceback' not in done.stderr, done.stderr
        edges = edges_in(file)
    return edges


def test_view_frames_draws_the_same_edges_as_that_of_tf2(two_kinds, run, tmp_path):
    theirs = drawn(run, tmp_path / 'theirs.gv',
                   'python3', '-m', 'tf2_tools.view_frames', '-o', str(tmp_path / 'theirs'))
    ours = drawn(run, tmp_path / 'ours.dot',
                 'ros2', 'run', 'tf_tree_py', 'view_frames', '-o', str(tmp_path / 'ours.dot'))
    assert ('gripper', 'lens') in ours and len(ours) == 5
    assert theirs == ours
