# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Deserializes recorded messages of any type that rosbags or the list below defines."""

from functools import cache
from typing import Any

from .message_source import MessageSource

# Types that rosbags does not define. The files of a recorder that was killed have no definitions.
_DEFINITIONS = {
    'vision_msgs/msg/ObjectHypothesis': 'string class_id\nfloat64 score\n',
    'vision_msgs/msg/ObjectHypothesisWithPose':
        'vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n',
    'vision_msgs/msg/BoundingBox3D': 'geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n',
    'vision_msgs/msg/Detection3D':
        'std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n'
        'vision_msgs/BoundingBox3D bbox\nstring id\n',
    'vision_msgs/msg/Detection3DArray':
        'std_msgs/Header header\nvision_msgs/Detection3D[] detections\n',
    'apriltag_ros/msg/AprilTagDetection':
        'int32[] id\nfloat64[] size\ngeometry_msgs/PoseWithCovarianceStamped pose\n',
    'apriltag_ros/msg/AprilTagDetectionArray':
        'std_msgs/Header header\napriltag_ros/AprilTagDetection[] detections\n',
    'isaac_ros_apriltag_interfaces/msg/AprilTagDetection':
        'string family\nint32 id\ngeometry_msgs/Point center\ngeometry_msgs/Point[4] corners\n'
        'geometry_msgs/PoseWithCovarianceStamped pose\n',
    'isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray':
        'std_msgs/Header header\n'
        'isaac_ros_apriltag_interfaces/AprilTagDetection[] detections\n',
}


def decode(source: MessageSource, data: bytes) -> Any:
    """
    Return a message as an object with its fields.

    :raises Exception: rosbags raises many kinds for unknown types and damaged bytes.
    """
    package, *_, name = source.type_name.split('/')
    store = _types(source.ros1)
    return (store.deserialize_ros1 if source.ros1 else store.deserialize_cdr)(
        data, f'{package}/msg/{name}')


@cache
def _types(ros1: bool) -> Any:
    from rosbags.typesys import get_types_from_msg, get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    for name, text in _DEFINITIONS.items():
        if name not in store.fielddefs:
            store.register(get_types_from_msg(text, name))
    return store
