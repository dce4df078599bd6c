# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The names that ``from tf2_ros import *`` includes because tf2's modules import them.

Public programs rely on them: they use ``Node``, ``Tuple`` or ``sleep`` without importing them.
"""

from importlib.util import find_spec

_STARS = {
    'tf2_ros':
        'ActionClient Any buffer buffer_client buffer_interface builtin_interfaces '
        'Callable Clock deepcopy DurabilityPolicy Duration FrameGraph '
        'FrameGraphSrvRequest FrameGraphSrvResponse Future Header HistoryPolicy '
        'JumpThreshold List LookupTransform LookupTransformGoal LookupTransformResult '
        'MsgStamped Node Optional PointCloud2 PointStamped PoseStamped '
        'PoseWithCovarianceStamped PyKDLType QoSProfile rclpy ReentrantCallbackGroup '
        'SingleThreadedExecutor sleep static_transform_broadcaster tf2 tf2_ros TFMessage '
        'Thread threading Time TimeJump transform_broadcaster transform_listener '
        'TransformableObject TransformableObjectType TransformStamped Tuple TypeVar Union '
        'Vector3Stamped warnings',
    'tf2_ros.buffer':
        'Any Callable Duration FrameGraph FrameGraphSrvRequest FrameGraphSrvResponse '
        'Future JumpThreshold List Node Optional rclpy sleep tf2 tf2_ros threading Time '
        'TimeJump TransformStamped Tuple TypeVar',
    'tf2_ros.buffer_client':
        'ActionClient builtin_interfaces Clock Duration LookupTransform '
        'LookupTransformGoal LookupTransformResult Node sleep tf2 tf2_ros threading Time '
        'TransformStamped TypeVar warnings',
    'tf2_ros.buffer_interface':
        'Any Callable deepcopy Duration Header MsgStamped Optional PointCloud2 '
        'PointStamped PoseStamped PoseWithCovarianceStamped PyKDLType rclpy tf2 tf2_ros '
        'Time TransformableObject TransformableObjectType TransformStamped Tuple TypeVar '
        'Union Vector3Stamped',
    'tf2_ros.static_transform_broadcaster':
        'DurabilityPolicy HistoryPolicy List Node Optional QoSProfile TFMessage '
        'TransformStamped Union',
    'tf2_ros.transform_broadcaster':
        'List Node Optional QoSProfile TFMessage TransformStamped Union',
    'tf2_ros.transform_listener':
        'DurabilityPolicy HistoryPolicy Node Optional QoSProfile ReentrantCallbackGroup '
        'SingleThreadedExecutor tf2_ros TFMessage Thread Union',
    'tf2_geometry_msgs.tf2_geometry_msgs': 'Iterable np Optional Point Point32 tf2_ros Tuple',
    'tf2_sensor_msgs.tf2_sensor_msgs': 'Header np tf2_ros Transform TransformStamped Union',
}
# From a package that may not be installed.
_SENSOR_MSGS_PY = {
    'tf2_sensor_msgs.tf2_sensor_msgs':
        'create_cloud read_points structured_to_unstructured unstructured_to_structured',
}


def star(module: str) -> list[str]:
    """Return the names that a module of tf2 only imports and that a star import includes."""
    names = _STARS[module].split()
    if module in _SENSOR_MSGS_PY and find_spec('sensor_msgs_py'):
        names += _SENSOR_MSGS_PY[module].split()
    return names
