# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Types that tf2_ros defines for annotations, and that programs also use in theirs."""

from typing import TypeVar

from geometry_msgs.msg import (
    PointStamped,
    PoseStamped,
    PoseWithCovarianceStamped,
    Vector3Stamped,
)
from sensor_msgs.msg import PointCloud2

MsgStamped = (PointStamped | PoseStamped | PoseWithCovarianceStamped | Vector3Stamped
              | PointCloud2)
PyKDLType = TypeVar('PyKDLType')
TransformableObject = MsgStamped | PyKDLType
TransformableObjectType = TypeVar('TransformableObjectType')

FrameGraphSrvRequest = TypeVar('FrameGraphSrvRequest')
FrameGraphSrvResponse = TypeVar('FrameGraphSrvResponse')
LookupTransformGoal = TypeVar('LookupTransformGoal')
LookupTransformResult = TypeVar('LookupTransformResult')
