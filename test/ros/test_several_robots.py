# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Several robots with the same software, in one tree."""

import itertools
import math

import pytest
from ros_helpers import at, PATIENCE, until
from tf_tree_py import (
    Buffer,
    Pose,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
)
from tf_tree_py.ros.messages.convert import transform_stamped

ROBOTS = range(1, 21)
MOVING = {'odom': 'map', 'base_link': 'odom', 'arm_1': 'base_link', 'arm_2': 'arm_1',
          'arm_3': 'arm_2', 'gripper': 'arm_3', 'pan': 'base_link', 'tilt': 'pan'}
FIXED = {'camera': 'tilt', 'camera_optical': 'camera', 'imu': 'base_link', 'lidar': 'base_link',
         'left_wheel': 'base_link', 'right_wheel': 'base_link', 'finger': 'gripper'}
FRAMES = [*MOVING, *FIXED]


class Robot:
    """One of twenty, with 15 frames below the map; its software uses the same names as all."""

    def __init__(self, number, make_node):
        self.name, self._number = f'robot{number}', number
        node = make_node('driver', namespace=self.name)
        self._moving = TransformBroadcaster(node, tf_topic='tf')
        fixed = StaticTransformBroadcaster(node, tf_static_topic='tf_static')
        fixed.sendTransform(self._transforms(FIXED, 0.0))

    def move(self, *times):
        until(self._moving.pub_tf.get_subscription_count)
        for seconds in times:
            self._moving.sendTransform(self._transforms(MOVING, seconds))

    def _transforms(self, parents, seconds):
        return [transform_stamped(parent, child, at(seconds).nanoseconds,
                                  self._parent_T(child, seconds))
                for child, parent in parents.items()]

    def _parent_T(self, child, seconds):
        """Return the true pose, different for all robots and frames, with constant velocity."""
        angle = 0.1 * self._number + 0.3 * FRAMES.index(child)
        x = self._number + (0.25 * seconds if child in MOVING else 0.0)
        return Pose(x, 0.5 * FRAMES.index(child), 0.1, 0.0, math.sin(angle), 0.0, math.cos(angle))

    def map_T(self, frame, seconds):
        if frame == 'map':
            return Pose()
        parent = MOVING.get(frame) or FIXED[frame]
        return self.map_T(parent, seconds) @ self._parent_T(frame, seconds)


def test_twenty_robots_of_fifteen_frames_are_one_tree(make_node):
    robots = [Robot(number, make_node) for number in ROBOTS]
    buffer, node = Buffer(), make_node('fleet')
    listeners = [TransformListener(
        buffer, node, tf_topic=f'/{robot.name}/tf', tf_static_topic=f'/{robot.name}/tf_static',
        frame_prefix=f'{robot.name}/', shared_frames=['map']) for robot in robots]
    for robot in robots:
        robot.move(1.0, 2.0)
    for robot, frame in itertools.product(robots, FRAMES):
        buffer.lookup_transform('map', f'{robot.name}/{frame}', at(2.0), PATIENCE)
    # Every robot as seen from the next one, at a stamp between two published ones.
    for one, other in itertools.pairwise(robots):
        for frame in FRAMES:
            truth = one.map_T('camera', 1.5).inverse() @ other.map_T(frame, 1.5)
            found = buffer.lookup(f'{one.name}/camera', f'{other.name}/{frame}',
                                  at(1.5).nanoseconds)
            # As matrices, because a quaternion and its negative are one rotation.
            assert found.as_matrix() == pytest.approx(truth.as_matrix(), abs=1e-9)
    assert len(buffer.frames()) == 1 + len(robots) * len(FRAMES)
    assert buffer.statistics().refused == 0
    way = ['/robot2/driver', '/robot1/driver']
    until(lambda: way == [edge.authority for edge in buffer.edges_between(
        'robot1/odom', 'robot2/odom')])
    # The others go on when one listener is closed.
    listeners[0].close()
    robots[1].move(3.0)
    buffer.lookup_transform('map', 'robot2/odom', at(3.0), PATIENCE)
    assert node.get_subscriptions_info_by_topic('/robot1/tf') == []
