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

"""Publishes samples again, as bytes: message objects would cost ten times as much."""

from collections.abc import Collection

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write


class Outlet:
    """A topic of TFMessages."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        """Make the publisher."""
        self._node = node
        self._publisher = node.create_publisher(TFMessage, topic, qos)

    def send(self, samples: Collection[Sample]) -> None:
        """Publish one message."""
        try:
            self._publisher.publish(write(samples))
        except Exception as error:  # noqa: B902 - whatever it is, the next must get through
            # When the context ends, rclpy raises anything.
            if self._node.context.ok():
                self._node.get_logger().error(
                    f'{len(samples)} transforms could not be passed on: {error}',
                    throttle_duration_sec=10.0)
