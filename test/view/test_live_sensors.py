# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Topics of sensors are subscribed while they are needed, and so is the robot's description."""

import pytest

rclpy = pytest.importorskip('rclpy', reason='live sensors need ROS')

from rclpy.node import Node  # noqa: E402
from ros_helpers import until  # noqa: E402
from sensor_msgs.msg import LaserScan  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tf_tree_py.ros.topics.qos import static_broadcaster_qos  # noqa: E402
from tf_tree_py.view.sensors.live_sensors import LiveSensors  # noqa: E402

SECOND = 1_000_000_000


@pytest.fixture
def node():
    context = rclpy.Context()
    context.init()
    node = Node('robot', context=context)
    yield node
    node.destroy_node()
    context.shutdown()


def test_topic_is_subscribed_to_while_a_page_wants_it(node):
    described = []
    node.create_publisher(String, 'robot_description', static_broadcaster_qos()).publish(
        String(data='<robot/>'))
    scans = node.create_publisher(LaserScan, 'scan', 10)
    sensors = LiveSensors(node, described.append)
    until(lambda: described == ['<robot/>'] and '/scan' in sensors.topics())
    assert scans.get_subscription_count() == 0
    for page in ('one', 'other'):
        sensors.want('/scan', page)
    scan = LaserScan(ranges=[1.0, 2.0], range_max=9.0)
    scan.header.frame_id, scan.header.stamp.sec = 'laser', 5

    def heard():
        scans.publish(scan)
        return sensors.reading('/scan', 5 * SECOND)

    until(heard)
    assert sensors.reading('/scan', 5 * SECOND).points.tolist() == [[1, 0, 0], [2, 0, 0]]
    assert sensors.reading('/scan', 5 * SECOND - 1) is None
    sensors.release('/scan', 'one')
    assert sensors.reading('/scan', 5 * SECOND) is not None
    sensors.release('/scan', 'other')
    until(lambda: scans.get_subscription_count() == 0)
    sensors.close()
