# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers of the tests of the drop-in."""

import os
import sys

from programs import completed

# The beginning of a program: its listener has received an edge, and its node was never spun.
LISTENS = """
    import rclpy
    from rclpy.time import Time
    import tf2_ros

    rclpy.init()
    node = rclpy.create_node('listens')
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer, node)
    broadcaster = tf2_ros.StaticTransformBroadcaster(node)
    message = tf2_ros.TransformStamped(child_frame_id='camera')
    message.header.frame_id = 'base'
    broadcaster.sendTransform(message)
    assert buffer.can_transform('base', 'camera', Time(), rclpy.duration.Duration(seconds=20))
"""


def run(*arguments, path='', **options):
    """Run Python; the packages on its path are found as if they were installed."""
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(path), os.environ.get('PYTHONPATH', '')])}
    return completed(sys.executable, *map(str, arguments), env=environment, **options)
