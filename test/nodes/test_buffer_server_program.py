# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The buffer server as a process, asked from another."""

import signal
import threading

from programs import PATIENCE_S
import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py import BufferClient, TimeoutException
from tf_tree_py.nodes import buffer_server
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


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['--size', '3'], 'unrecognized arguments: --size 3 (--help tells more)'),
    (['--ros-args', '-p', 'buffer_size'], "Couldn't parse parameter override rule: "
     "'-p buffer_size'"),
])
def test_mistake_in_arguments_is_one_sentence(monkeypatch, capsys, arguments, sentence):
    monkeypatch.setattr(buffer_server, 'run', None)
    with pytest.raises(SystemExit) as ended:
        buffer_server.main(['buffer_server', *arguments])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told.startswith('buffer_server: ')
    assert sentence in told
    assert told.count('\n') == 1


@pytest.mark.parametrize('given', ['-1.0', 'long', 'true'])
def test_mistake_in_a_parameter_is_one_sentence(start, given):
    program = start('buffer_server', '--ros-args', '-p', f'buffer_size:={given}')
    assert program.end() == 1
    assert program.output.startswith(
        'buffer_server: parameter buffer_size has to be a number from 0.0 to 1000000000.0, not ')
    assert program.output.count('\n') == 1
