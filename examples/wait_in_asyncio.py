# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Two terminals: ros2 run tf_tree_py five_frame_publisher; python3 examples/wait_in_asyncio.py
"""Awaits transforms in asyncio, without an executor, extra threads or polling."""
import asyncio

import rclpy
from rclpy.duration import Duration
from rclpy.time import Time
from tf_tree_py import Buffer, TransformException, TransformListener


async def main(buffer):
    in_time = Duration(seconds=20.0)
    arm, camera = await asyncio.gather(
        buffer.lookup_transform_async('world', 'gripper', Time(), in_time),
        buffer.lookup_transform_async('world', 'camera', Time(), in_time))
    print(f'gripper at z = {arm.transform.translation.z:.3f} m')
    print(f'camera at z = {camera.transform.translation.z:.3f} m')
    try:
        await buffer.lookup_transform_async('world', 'nowhere', Time(), Duration(seconds=0.1))
    except TransformException as error:
        print(error)


rclpy.init()
node = rclpy.create_node('waits_in_asyncio')
buffer = Buffer()
with TransformListener(buffer, node):
    asyncio.run(main(buffer))
rclpy.shutdown()
