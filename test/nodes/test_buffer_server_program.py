# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer server as a process, with a client in another."""

import signal
import threading

from conditions import until
from programs import PATIENCE_S
import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py import BufferClient, ExtrapolationException, TimeoutException
from tf_tree_py.nodes import buffer_server, running
from tf_tree_py.nodes.five_frame_publisher import FiveFramePublisher
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_nanoseconds, as_pose

PATIENCE = Duration(seconds=PATIENCE_S)


@pytest.fixture
def client(context):
    node = Node('asking', context=context)
    with BufferClient(node, 'tf2_buffer_server') as client:
        yield client
    node.destroy_node()


@pytest.mark.parametrize('end', [signal.SIGINT, signal.SIGTERM])
def test_process_hears_and_answers_until_ctrl_c(start, client, context, end):
    program = start('buffer_server', '--ros-args', '-p', 'buffer_size:=60')
    robot = FiveFramePublisher(context=context)
    with spun_in_background(robot):
        found = client.lookup_transform('odom', 'base_link', Time(), PATIENCE)
        later = Time(nanoseconds=as_nanoseconds(found.header.stamp) + 100_000_000)
        found = client.lookup_transform('odom', 'base_link', later, PATIENCE)
        assert found.header.stamp == later.to_msg()
        truth = robot.motion.odom_T_base_link(later.nanoseconds)
        assert as_pose(found).as_matrix() == pytest.approx(truth.as_matrix(), abs=1e-3)
    call, ended = client.wait_for_transform_async('odom', 'nowhere', Time()), threading.Event()
    call.add_done_callback(lambda _: ended.set())
    program.interrupt(end)
    assert program.end() == 0
    assert program.output == ''
    assert ended.wait(PATIENCE_S)
    with pytest.raises(TimeoutException, match='went away before it answered'):
        call.result()


def test_its_max_age_is_an_error_of_clients_that_ask_for_the_latest(start, client, context):
    start('buffer_server', '--ros-args', '-p', 'max_age:=1.0')
    assert client.wait_for_server(PATIENCE)
    robot = FiveFramePublisher(context=context)
    with spun_in_background(robot):
        # The static edges come on a topic of their own, and may come last.
        until(lambda: client.can_transform('odom', 'camera', Time()))
    until(lambda: not client.can_transform('odom', 'base_link', Time()))
    # A busy server may learn the name of the publisher only after that has gone.
    with pytest.raises(ExtrapolationException, match='the edge odom -> base_link, last published '
                       "by '.*publisher.*', is .* old, and max_age is 1.000 s"):
        client.lookup_transform('odom', 'base_link', Time())
    assert client.can_transform('base_link', 'camera', Time())


def test_node_and_its_name_are_tf2s(start, client):
    start('buffer_server')
    assert client.wait_for_server(PATIENCE)
    assert client.node.wait_for_node('/tf_buffer', PATIENCE_S)


def test_impatient_ctrl_c_ends_it_cleanly(start, client):
    program = start('buffer_server')
    assert client.wait_for_server(PATIENCE)
    program.interrupt_until_it_ends()
    assert program.end() == 0
    assert program.output == ''


def test_mistake_in_arguments_is_one_sentence(monkeypatch, capsys):
    monkeypatch.setattr(running, 'run', None)
    with pytest.raises(SystemExit) as ended:
        buffer_server.main(['buffer_server', '--size', '3'])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told == 'buffer_server: unrecognized arguments: --size 3 (see --help)\n'


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['-p', 'buffer_size'], "Couldn't parse parameter override rule: '-p buffer_size'"),
    (['--speed'], "unknown ROS arguments ['--speed']"),
])
def test_mistake_in_arguments_of_ros_is_one_sentence(start, arguments, sentence):
    program = start('buffer_server', '--ros-args', *arguments)
    assert program.end() == 2
    told = program.output.splitlines()[-1]  # after possible log lines of rcl
    assert told.startswith('buffer_server: ') and sentence in told


@pytest.mark.parametrize('given', ['-1.0', 'long', 'true'])
def test_mistake_in_a_parameter_is_one_sentence(start, given):
    program = start('buffer_server', '--ros-args', '-p', f'buffer_size:={given}')
    assert program.end() == 2
    assert program.output.startswith(
        'buffer_server: parameter buffer_size must be a number from 0.0 to 1000000000.0, not ')
    assert program.output.count('\n') == 1
