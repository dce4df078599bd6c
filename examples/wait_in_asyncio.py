# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

# Two terminals: ros2 run tf_tree_py five_frame_publisher; python3 examples/wait_in_asyncio.py
"""Awaits transforms in asyncio: no executor, no thread of one's own, no polling."""
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
