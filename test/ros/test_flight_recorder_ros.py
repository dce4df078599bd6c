# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``Buffer(flight_recorder=...)`` writes received messages to a bag when a lookup fails."""

import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from tf_tree_py import Buffer, FlightRecorder, Pose, TransformException
from tf_tree_py.bag import open_bag
from tf_tree_py.ros.messages.convert import transform_stamped


def test_what_a_listener_heard_is_recorded_on_the_first_lookup_that_is_lost(
        tmp_path, node, talker, listen):
    recorder = FlightRecorder(tmp_path)
    buffer = listen(node, Buffer(flight_recorder=recorder))
    now = node.get_clock().now().nanoseconds
    talker.fix(transform_stamped('base', 'lidar', 0, Pose(z=1.0)))
    talker.move(transform_stamped('odom', 'base', now, Pose(x=2.0)))
    with pytest.raises(TransformException):  # it never worked before
        buffer.lookup_transform('odom', 'nowhere', Time())
    buffer.lookup_transform('odom', 'lidar', Time(nanoseconds=now), Duration(seconds=30))
    late = Time(nanoseconds=now + 10**9)
    for _ in range(2):
        with pytest.raises(TransformException):
            buffer.lookup_transform('odom', 'lidar', late, Duration(seconds=0.05))
    recorder.close()
    bag, = tmp_path.glob('*_lookup_failed.mcap')
    assert open_bag(bag).lookup('odom', 'lidar', now) == Pose(x=2.0, z=1.0)
