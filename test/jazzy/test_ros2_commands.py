# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The output of ``ros2`` and of tf2's own tools for this package's running nodes."""

import re

from conditions import until
import pytest

NODES = {'/five_frame_publisher', '/five_frame_listener', '/tf_buffer', '/robot1/tf_relay',
         '/asking', '/mounted'}

# A node of a user: two listeners, a client of the buffer server, a filter.
ASKING = """
import rclpy
from tf_tree_py import Buffer, BufferClient, TransformListener

rclpy.init()
node = rclpy.create_node('asking')
node.declare_parameter('speed', 0.5)
buffers = [Buffer(node=node), Buffer(node=node)]
listeners = [TransformListener(buffers[0], node), TransformListener(buffers[1], node),
             TransformListener(buffers[1])]
client = BufferClient(node, 'tf2_buffer_server')
print('ready', flush=True)
rclpy.spin(node)
"""


@pytest.fixture(scope='module', autouse=True)
def robot(start_for_all, await_output):
    """Start a robot with all nodes of this package, and wait until ``ros2`` discovers it."""
    def run(name, *words):
        return start_for_all('ros2', 'run', 'tf_tree_py', name, *words)

    run('five_frame_publisher')
    run('five_frame_listener').wait_for('xyz')
    run('buffer_server')
    run('tf_relay', '--ros-args', '-r', '__ns:=/robot1')
    run('static_transform_publisher', '--frame-id', 'gripper', '--child-frame-id', 'probe',
        '--x', '0.1', '--ros-args', '-r', '__node:=mounted')
    start_for_all('python3', '-c', ASKING).wait_for('ready')
    for name in NODES:
        await_output(f'(?m)^{name}$', 'node', 'list')


def test_node_list_shows_the_users_nodes_and_nothing_else(await_output):
    # Nodes of other tests may be listed for a moment after they have ended.
    await_output('^' + ''.join(f'{name}\n' for name in sorted(NODES)) + '$', 'node', 'list')


def test_param_list_waits_for_nobody(run):
    def lists_all():
        done = run('ros2', 'param', 'list')
        assert (done.returncode, done.stderr) == (0, '')
        assert 'timed out' not in done.stdout
        nodes = {line.rstrip(':') for line in done.stdout.splitlines() if line.startswith('/')}
        return nodes == NODES and '  speed\n' in done.stdout

    until(lists_all)  # on a busy machine a command may miss a node


@pytest.mark.parametrize('name', sorted(NODES))
def test_parameters_of_every_node_are_answered(output_of, name):
    assert 'use_sim_time: false' in output_of('param', 'dump', name)
    assert 'Boolean value is: False' in output_of('param', 'get', name, 'use_sim_time')


@pytest.mark.parametrize('name', sorted(NODES))
def test_every_node_tells_what_it_has(await_output, name):
    service = f'{name}/list_parameters: rcl_interfaces/srv/ListParameters'
    await_output(service, 'node', 'info', name)


@pytest.mark.parametrize('topic', ['/tf', '/tf_static'])
def test_topics_are_those_of_tf2(await_output, topic):
    await_output(rf'(?m)^{topic} \[tf2_msgs/msg/TFMessage\]$', 'topic', 'list', '-t')


def test_echo_shows_what_moves_and_what_does_not(output_of, await_output):
    assert 'child_frame_id: ' in output_of('topic', 'echo', '--once', '/tf')
    # Two nodes publish there, and a late echo gets the last message of either first.
    await_output('child_frame_id: probe', 'topic', 'echo', '--once', '/tf_static')


def test_who_listens_and_who_talks_is_told(await_output):
    info = 'topic', 'info', '--verbose', '/tf'
    await_output('Node name: five_frame_publisher', *info)
    # Listeners have a separate node with a descriptive name.
    await_output('(?s)(Node name: _transform_listener_impl_.*){4}', *info)


def test_buffer_server_is_found_as_tf2s(output_of, await_output):
    await_output('Action servers: 1\n    /tf_buffer', 'action', 'info', '/tf2_buffer_server')
    await_output('tf2_msgs/action/LookupTransform', 'action', 'list', '-t')
    output = output_of('service', 'call', '/tf2_frames', 'tf2_msgs/srv/FrameGraph')
    assert "parent: 'gripper'" in output or "parent: \\'gripper\\'" in output


def test_goal_from_the_command_line_is_answered(output_of):
    output = output_of(
        'action', 'send_goal', '/tf2_buffer_server', 'tf2_msgs/action/LookupTransform',
        '{target_frame: gripper, source_frame: probe}')
    assert re.search(r'translation:\n\s+x: 0.1\n', output)
    assert 'SUCCEEDED' in output


def test_tf2_echo_hears_our_publishers(start):
    echo = start('ros2', 'run', 'tf2_ros', 'tf2_echo', 'world', 'probe')
    echo.wait_for('- Translation:')


def test_view_frames_draws_our_tree(run, tmp_path):
    done = run('python3', '-m', 'tf2_tools.view_frames', '-o', str(tmp_path / 'frames'))
    assert done.returncode == 0, done.stderr
    drawn = (tmp_path / 'frames.gv').read_text()
    for parent, child in (('world', 'odom'), ('gripper', 'probe')):
        assert f'"{parent}" -> "{child}"' in drawn
