# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Names that tf2's modules only import, but that programs import from them.

Any module gets them with ``from tf_tree_py.dropin.imported_names import __getattr__``;
``star_imports`` lists those that a star import includes.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    'copy': ['deepcopy'],
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
    'threading': ['Thread'],
    'time': ['sleep'],
    'typing': ['Any', 'Callable', 'Iterable', 'List', 'Optional', 'Tuple', 'TypeVar', 'Union'],
    'tf_tree_py.dropin.annotations': [
        'FrameGraphSrvRequest', 'FrameGraphSrvResponse', 'LookupTransformGoal',
        'LookupTransformResult', 'MsgStamped', 'PyKDLType', 'TransformableObject',
        'TransformableObjectType'],
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_MODULES = {'builtin_interfaces': 'builtin_interfaces', 'np': 'numpy', 'rclpy': 'rclpy',
            'tf2': 'tf2_py', 'tf2_ros': 'tf2_ros', 'threading': 'threading',
            'warnings': 'warnings'}

# From a package that may not be installed.
_HOME_OF |= dict.fromkeys(['create_cloud', 'read_points'], 'sensor_msgs_py.point_cloud2')
_HOME_OF |= dict.fromkeys(['structured_to_unstructured', 'unstructured_to_structured'],
                          'numpy.lib.recfunctions')


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME_OF:
        raise AttributeError(f"tf_tree_py's replacement of tf2 has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)
