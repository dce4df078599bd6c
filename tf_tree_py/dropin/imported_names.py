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

"""
Names that tf2's modules only import, but that programs import from them.

Any module gets them with ``from tf_tree_py.dropin.imported_names import __getattr__``.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    'geometry_msgs.msg': [
        'Point', 'Point32', 'PointStamped', 'PolygonStamped', 'Pose', 'PoseStamped',
        'PoseWithCovarianceStamped', 'Transform', 'TransformStamped', 'Vector3Stamped'],
    'rclpy.action.client': ['ActionClient'],
    'rclpy.callback_groups': ['ReentrantCallbackGroup'],
    'rclpy.clock': ['Clock', 'JumpThreshold', 'TimeJump'],
    'rclpy.duration': ['Duration'],
    'rclpy.executors': ['SingleThreadedExecutor'],
    'rclpy.node': ['Node'],
    'rclpy.qos': ['DurabilityPolicy', 'HistoryPolicy', 'QoSProfile'],
    'rclpy.task': ['Future'],
    'rclpy.time': ['Time'],
    'sensor_msgs.msg': ['PointCloud2'],
    'std_msgs.msg': ['Header'],
    'tf2_msgs.action': ['LookupTransform'],
    'tf2_msgs.msg': ['TF2Error', 'TFMessage'],
    'tf2_msgs.srv': ['FrameGraph'],
    'tf_tree_py.dropin.annotations': [
        'FrameGraphSrvRequest', 'FrameGraphSrvResponse', 'LookupTransformGoal',
        'LookupTransformResult', 'MsgStamped', 'PyKDLType', 'TransformableObject',
        'TransformableObjectType'],
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_MODULES = {'builtin_interfaces': 'builtin_interfaces', 'rclpy': 'rclpy', 'tf2': 'tf2_py',
            'tf2_ros': 'tf2_ros'}

NAMES = sorted([*_HOME_OF, *_MODULES])

# From a package that may not be installed.
_HOME_OF |= dict.fromkeys(['create_cloud', 'read_points'], 'sensor_msgs_py.point_cloud2')


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME_OF:
        raise AttributeError(f'tf2 has no attribute {name!r} here')
    return getattr(import_module(_HOME_OF[name]), name)
