# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One buffer and one listener for all nodes of a process with the same topics."""

import gc

import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from ros_helpers import LATEST, PATIENCE, receivers, SIM_TIME, simulated_seconds, transform, until
from tf_tree_py import shared_buffer


def listening():
    """Return the number of threads that listen."""
    gc.collect()
    return len(receivers())


def test_nodes_share_one_buffer_one_thread_and_one_subscription(make_node, talker, pool):
    nodes = [make_node(f'node{number}') for number in range(8)]
    buffers = [*pool.map(shared_buffer, nodes), *map(shared_buffer, nodes)]
    assert len({id(buffer) for buffer in buffers}) == 1 and listening() == 1
    assert nodes[0].count_subscribers('/tf') == 1
    talker.move(transform('map', 'base', 1.0))
    assert buffers[0].can_transform('map', 'base', LATEST, PATIENCE)


@pytest.mark.parametrize('options', [
    {'frame_prefix': 'r1/'}, {'frame_filter': ['map', 'base']}, {'static_only': True},
    {'cache_time': Duration(seconds=30)}, {'tf_topic': 'arm/tf'}, {'qos': QoSProfile(depth=7)},
], ids=lambda options: next(iter(options)))
def test_who_hears_otherwise_has_a_buffer_of_its_own(make_node, options):
    one, other = make_node('one'), make_node('other')
    common = shared_buffer(one)
    apart = shared_buffer(other, **options)
    assert apart is not common and listening() == 2
    # Equal arguments get the same buffer.
    assert shared_buffer(one, **options) is apart
    assert shared_buffer(other) is common
    assert listening() == 2


def test_namespaces_and_remappings_keep_robots_apart(make_node):
    remapped = ['--ros-args', '-r', '/tf:=tf', '-r', '/tf_static:=tf_static']
    robots = [make_node('driver', namespace=name, cli_args=remapped) for name in ('r1', 'r2')]
    beside = make_node('camera', namespace='r1', cli_args=remapped)
    first, second = map(shared_buffer, robots)
    assert first is not second
    assert shared_buffer(beside) is first


def test_clocks_keep_nodes_apart_and_the_buffer_follows_its_node(make_node):
    wall = make_node('wall')
    simulated = make_node('simulated', **SIM_TIME)
    buffer = shared_buffer(simulated)
    assert shared_buffer(wall) is not buffer
    until(lambda: simulated_seconds(buffer) is not None)
    simulated.set_parameters([Parameter('use_sim_time', value=False)])
    until(lambda: simulated_seconds(buffer) is None)
    assert shared_buffer(simulated) is buffer


def test_listener_ends_with_the_last_node(context, make_node):
    one, forgotten = make_node('one'), rclpy.create_node('forgotten', context=context)
    buffer = shared_buffer(one)
    assert shared_buffer(forgotten) is buffer
    one.destroy_node()
    assert listening() == 1
    del forgotten
    until(lambda: listening() == 0)
    assert len(buffer.feeds) == 0
    later = make_node('later')
    assert shared_buffer(later) is not buffer
    later.destroy_node()
    until(lambda: listening() == 0)


def test_context_is_a_user_until_it_ends(make_node):
    context, remapped = Context(), ['--ros-args', '-r', '/tf:=/robot/tf']
    rclpy.init(context=context, args=remapped)
    node = rclpy.create_node('beside', context=context)
    buffer = shared_buffer(context)
    assert shared_buffer(context) is buffer is shared_buffer(node)
    node.destroy_node()
    assert listening() == 1
    # Another context has nothing in common with it.
    assert shared_buffer(make_node('elsewhere', cli_args=remapped)) is not buffer
    assert listening() == 2
    context.shutdown()
    until(lambda: listening() == 1)


def test_wrong_options_are_refused_and_leave_nothing(make_node):
    node = make_node('wrong')
    with pytest.raises(TypeError, match='spin_thread'):
        shared_buffer(node, spin_thread=False)
    with pytest.raises(TypeError, match='frame_prefx'):
        shared_buffer(node, frame_prefx='r1/')
    with pytest.raises(RuntimeError, match='rclpy.init'):
        shared_buffer(Context())
    assert listening() == 0
