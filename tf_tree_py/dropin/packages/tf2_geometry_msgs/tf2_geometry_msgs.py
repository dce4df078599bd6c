# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_geometry_msgs.tf2_geometry_msgs, and the messages that it imports."""

import geometry_msgs.msg
from geometry_msgs.msg import (
    PointStamped,
    PolygonStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Vector3Stamped,
)
from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.dropin.installed_tf2 import from_msg_msg, register, to_msg_msg
from tf_tree_py.ros.messages.do_transform import (
    do_transform_accel,
    do_transform_point,
    do_transform_polygon_stamped,
    do_transform_pose,
    do_transform_pose_stamped,
    do_transform_pose_with_covariance_stamped,
    do_transform_quaternion,
    do_transform_transform,
    do_transform_twist,
    do_transform_vector3,
    do_transform_wrench,
    transform_covariance,
)

__all__ = [
    'do_transform_accel',
    'do_transform_point',
    'do_transform_polygon_stamped',
    'do_transform_pose',
    'do_transform_pose_stamped',
    'do_transform_pose_with_covariance_stamped',
    'do_transform_quaternion',
    'do_transform_transform',
    'do_transform_twist',
    'do_transform_vector3',
    'do_transform_wrench',
    'from_msg_msg',
    'PointStamped',
    'PolygonStamped',
    'Pose',
    'PoseStamped',
    'PoseWithCovarianceStamped',
    'to_msg_msg',
    'transform_covariance',
    'TransformStamped',
    'Vector3Stamped',
    *star(__name__),
]

register(geometry_msgs.msg)
