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
