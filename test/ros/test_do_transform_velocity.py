# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Velocities become messages, which can be transformed further."""

import math

import pytest
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message
from ros_helpers import at
from tf_tree_py import Buffer, BufferCore, Pose
from tf_tree_py.core.twist import lookup_twist
from tf_tree_py.ros.buffer.twists import velocity_stamped
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.messages.do_transform import do_transform

SECOND = 1_000_000_000


@pytest.fixture
def buffer():
    buffer = BufferCore()
    for step in range(21):
        buffer.insert('odom', 'base', SECOND + step * SECOND // 10,
                      Pose.from_xyz_rpy(x=0.2 * step, yaw=math.pi / 2))
    return buffer


def test_velocity_says_what_moves_and_in_whose_axes(buffer):
    velocity = lookup_twist(buffer, 'base', 'odom', 2 * SECOND, SECOND // 5)
    message = velocity_stamped(velocity, 'base', 'odom')
    assert (message.header.frame_id, message.header.stamp) == ('odom', at(2).to_msg())
    assert (message.body_frame_id, message.reference_frame_id) == ('base', 'odom')
    linear, angular = message.velocity.linear, message.velocity.angular
    assert (linear.x, linear.y, linear.z) == pytest.approx((2.0, 0.0, 0.0), abs=1e-9)
    assert (angular.x, angular.y, angular.z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert type(deserialize_message(serialize_message(message), type(message))) is type(message)


def test_velocity_in_other_axes_is_the_velocity_transformed(buffer):
    arguments = buffer, 'base', 'odom', 2 * SECOND, SECOND // 5
    in_base = velocity_stamped(lookup_twist(*arguments, reference_frame='base'), 'base', 'odom',
                               'base')
    assert in_base.header.frame_id == 'base'
    base_T_odom = transform_stamped(
        'base', 'odom', 2 * SECOND, buffer.lookup('base', 'odom', 2 * SECOND))
    moved = do_transform(velocity_stamped(lookup_twist(*arguments), 'base', 'odom'), base_T_odom)
    assert moved.header == in_base.header
    assert (moved.body_frame_id, moved.reference_frame_id) == ('base', 'odom')
    for part in ('linear', 'angular'):
        one, other = getattr(moved.velocity, part), getattr(in_base.velocity, part)
        assert (one.x, one.y, one.z) == pytest.approx((other.x, other.y, other.z), abs=1e-9)
    assert in_base.velocity.linear.y == pytest.approx(-2.0)


def test_buffer_takes_times_of_ros(buffer):
    ours = Buffer()
    for step in range(21):
        ours.insert('odom', 'base', SECOND + step * SECOND // 10,
                    Pose.from_xyz_rpy(x=0.2 * step, yaw=math.pi / 2))
    interval = Duration(seconds=0.2)
    found = ours.lookup_twist('base', 'odom', at(2).to_msg(), interval, reference_frame='base')
    assert found == velocity_stamped(
        lookup_twist(buffer, 'base', 'odom', 2 * SECOND, SECOND // 5, reference_frame='base'),
        'base', 'odom', 'base')
    twists = ours.lookup_twist_many('base', 'odom', [2 * SECOND], interval, reference_frame='base')
    assert twists[0] == pytest.approx([0.0, -2.0, 0.0, 0.0, 0.0, 0.0], abs=1e-9)
