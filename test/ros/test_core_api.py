# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The methods of tf2_py.BufferCore, by their own names."""

from geometry_msgs.msg import Transform, TransformStamped
import pytest
from rclpy.clock import ClockChange, TimeJump
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import at, simulated_clock, with_a_lamp
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, LookupException, Pose
from tf_tree_py.ros.messages.convert import transform_stamped


@pytest.fixture
def buffer():
    return with_a_lamp(Buffer())


def test_can_tells_whether_and_why_not(buffer):
    at = Time(seconds=2)
    assert buffer.can_transform_core('map', 'arm', at) == (True, '')
    assert buffer.can_transform_full_core('map', at, 'arm', at, 'odom') == (True, '')
    for (can, why), reason in (
            (buffer.can_transform_core('map', 'nowhere', at),
             '"nowhere" passed to lookupTransform argument source_frame does not exist'),
            (buffer.can_transform_full_core('map', at, 'arm', Time(seconds=9), 'odom'),
             'extrapolation into the future')):
        assert not can
        assert reason in why


def test_latest_common_time_names_itself_and_not_a_lookup(buffer):
    with pytest.raises(LookupException, match=(
            '^"nowhere" passed to get_latest_common_time argument source_frame does not exist')):
        buffer.get_latest_common_time('map', 'nowhere')


@pytest.mark.parametrize(('given', 'what_to_do'), [
    ([TransformStamped()], 'this is a list: call set_transform for each of its items'),
    ((), 'this is a tuple: call set_transform for each of its items'),
    (TFMessage(), 'this is a TFMessage: call set_transform for each of its transforms'),
    (None, 'this is a NoneType$'), (Transform(), 'this is a Transform$')])
def test_what_is_no_single_transform_is_refused_with_what_to_call(buffer, given, what_to_do):
    for insert in buffer.set_transform, buffer.set_transform_static:
        with pytest.raises(TypeError, match=f'^a TransformStamped is needed, and {what_to_do}'):
            insert(given, 'me')


# --- of tf2_ros.Buffer


def test_jump_of_the_clock_calls_what_a_program_may_override():
    class Noting(Buffer):

        def time_jump_callback(self, time_jump):
            jumps.append(time_jump.delta.nanoseconds)
            super().time_jump_callback(time_jump)

    jumps, clock, buffer = [], simulated_clock(9.0), Noting()
    buffer.use_clock(clock)
    buffer.set_transform(transform_stamped('map', 'odom', 10**9, Pose()), 'test')
    clock.set_ros_time_override(at(7.0))
    assert jumps == [-2 * 10**9]
    assert not buffer.can_transform('map', 'odom', Time())


def test_program_may_say_that_the_clock_jumped(buffer):
    buffer.time_jump_callback(TimeJump(ClockChange.ROS_TIME_NO_CHANGE, Duration(seconds=-1)))
    assert buffer.frames() == ['odom', 'map', 'base', 'arm', 'lamp']
    assert not buffer.can_transform('map', 'odom', Time())


def test_clock_is_that_of_the_node_or_the_systems(node):
    assert Buffer(node=node).clock is node.get_clock()
    assert Buffer().clock.clock_type is ClockType.SYSTEM_TIME
