# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot and a desk on two separate hosts, and a link between them."""

import json
from pathlib import Path
import time

from domains import PROFILES_VARIABLE
from hosts import two_hosts
from programs import PATIENCE_S
from tf_tree_py import LATEST

GAP_S = 5.0
# With this profile, recovery takes less than a second after the link is up, else up to three.
PROFILES = Path(__file__).parents[2] / 'config' / 'fastdds_wireless.xml'
ENVIRONMENT = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', PROFILES_VARIABLE: str(PROFILES),
    # The two hosts share memory, and DDS must not communicate through it.
    'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}

ROBOT = """
    import sys
    import threading

    import rclpy
    from tf_tree_py import Pose, StaticTransformBroadcaster, TransformBroadcaster
    from tf_tree_py.ros.messages.convert import transform_stamped

    rclpy.init()
    node = rclpy.create_node('robot')
    fixed, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
    at_the_end = threading.Event()

    def drive():
        while not at_the_end.wait(0.02):
            now = node.get_clock().now().nanoseconds
            moving.sendTransform(transform_stamped('map', 'base', now, Pose(x=1.0)))

    driving = threading.Thread(target=drive)
    driving.start()
    print('drives', flush=True)
    # Each line is the name of a sensor to mount; the end of the input is the end.
    for line in sys.stdin:
        fixed.sendTransform(transform_stamped('base', line.strip(), 0, Pose(x=2.0)))
        print('mounted', flush=True)
    at_the_end.set()
    driving.join()
    rclpy.shutdown()
"""

DESK = """
    import json
    import sys

    import rclpy
    from tf_tree_py import Buffer, TransformException, TransformListener

    rclpy.init()
    buffer = Buffer()
    with TransformListener(buffer):
        print('listens', flush=True)
        # Each line asks where a frame is at a stamp, and how long to wait for the answer.
        for line in sys.stdin:
            frame, stamp, timeout_s = json.loads(line)
            try:
                print(buffer.lookup_within(timeout_s, 'map', frame, stamp).x, flush=True)
            except TransformException as error:
                print(type(error).__name__, flush=True)
    rclpy.shutdown()
"""


def test_after_a_gap_lookups_go_on_and_statics_that_were_missed_arrive():
    def where_is(frame, stamp=None, timeout_s=PATIENCE_S):
        """Return the desk's result for a frame, by default at the current time."""
        stamp = time.time_ns() if stamp is None else stamp
        return desk.tell(json.dumps([frame, stamp, timeout_s]))

    with two_hosts() as (robot, desk):
        robot.run(ROBOT, **ENVIRONMENT)
        desk.run(DESK, **ENVIRONMENT)
        assert robot.tell('camera') == 'mounted'
        # The latest first, because the time of discovery is unknown.
        assert where_is('camera', LATEST) == where_is('camera') == '3.0'
        robot.set_link('down')
        assert robot.tell('lidar') == 'mounted'
        assert where_is('base', timeout_s=GAP_S) == 'FutureExtrapolationException'
        assert where_is('lidar', LATEST, 0.0) == 'LookupException'
        robot.set_link('up')
        assert [where_is(frame) for frame in ('base', 'camera', 'lidar')] == ['1.0', '3.0', '3.0']
