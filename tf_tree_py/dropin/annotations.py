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

"""Types that tf2_ros defines for annotations, and that programs use in theirs."""

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
