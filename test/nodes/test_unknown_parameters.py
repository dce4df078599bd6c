# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An unknown parameter of a node is reported, with the most similar known one."""

import pytest
from rclpy.parameter import Parameter
from tf_tree_py.nodes.five_frame_listener import FiveFrameListener
from tf_tree_py.nodes.five_frame_publisher import FiveFramePublisher


def test_slip_of_the_pen_is_told_with_what_was_meant(start):
    program = start('five_frame_publisher', '--ros-args', '-p', 'radious:=2.0', '-p',
                    'radius:=1.0', '-p', 'use_sim_time:=true')
    program.wait_for('no parameter')
    program.interrupt()
    assert program.end() == 0
    output = program.output
    assert output.count('no parameter') == 1
    assert ("there is no parameter 'radious', so its value is ignored; did you mean 'radius'? "
            'Parameters: ') in output
    assert 'drive_rate_hz' in output


@pytest.mark.parametrize('name', [
    'buffer_server', 'edge_switch', 'tf_relay', 'tf_share', 'five_frame_listener',
    'urdf_broadcaster'])
def test_every_node_tells(start, name):
    program = start(name, '--ros-args', '-p', 'quux_xyzzy:=1')
    program.wait_for("there is no parameter 'quux_xyzzy', so its value is ignored. Parameters: ")


def test_node_without_parameters_tells(start):
    program = start('static_transform_publisher', '--frame-id', 'a', '--child-frame-id', 'b',
                    '--ros-args', '-p', 'frame_id:=c')
    program.wait_for(
        "no parameter 'frame_id', so its value is ignored. This node has no parameters")


def test_nodes_in_one_process_know_of_each_other(start):
    demo = start('five_frame_demo', '--seconds', '0.3', '--ros-args', '-p', 'rate_hz:=5', '-p',
                 'radius:=1', '-p', 'radious:=1')
    assert demo.end() == 0
    assert demo.output.count("no parameter 'radious'") == 2
    assert demo.output.count('no parameter') == 2


@pytest.mark.parametrize('cls', [FiveFramePublisher, FiveFrameListener])
def test_what_rclpy_declares_by_itself_is_known(context, capfd, cls):
    node = cls(context=context, parameter_overrides=[
        Parameter('use_sim_time', value=False), Parameter('frame_prefix', value='r/'),
        Parameter('qos_overrides./tf.publisher.depth', value=7)])
    node.destroy_node()
    assert 'no parameter' not in capfd.readouterr().err
