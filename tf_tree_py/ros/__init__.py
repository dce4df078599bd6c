"""The transform tree on ROS 2: needs rclpy, geometry_msgs and tf2_msgs."""

from .arrays import as_matrix, as_points
from .broadcaster import StaticTransformBroadcaster, TransformBroadcaster
from .buffer import Buffer
from .buffer_interface import BufferInterface
from .convert import as_pose
from .listener import TransformListener
from .registration import (
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    TransformRegistration,
    TypeException,
)

__all__ = [
    'as_matrix',
    'as_points',
    'as_pose',
    'Buffer',
    'BufferInterface',
    'ConvertRegistration',
    'NotImplementedException',
    'Stamped',
    'StaticTransformBroadcaster',
    'TransformBroadcaster',
    'TransformListener',
    'TransformRegistration',
    'TypeException',
]
