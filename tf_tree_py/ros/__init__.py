"""The transform tree on ROS 2: needs rclpy, geometry_msgs and tf2_msgs."""

from .broadcaster import StaticTransformBroadcaster, TransformBroadcaster
from .buffer import Buffer
from .listener import TransformListener

__all__ = ['Buffer', 'StaticTransformBroadcaster', 'TransformBroadcaster', 'TransformListener']
