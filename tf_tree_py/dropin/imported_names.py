# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Names that tf2's modules only import, but that programs import from them.

Any module gets them with ``from tf_tree_py.dropin.imported_names import __getattr__``; ``star``
lists those that ``from tf2_ros import *`` includes. Public programs rely on them: they use
``Node``, ``Tuple`` or ``sleep`` without importing them.
"""

from importlib import import_module
from importlib.util import find_spec
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


_LOADED = (
    'action_msgs.msg', 'action_msgs.srv', 'builtin_interfaces.msg', 'geometry_msgs.msg',
    'rclpy.action', 'rclpy.node', 'sensor_msgs.msg', 'std_msgs.msg', 'tf2_msgs.action',
    'tf2_msgs.msg', 'tf2_msgs.srv', 'unique_identifier_msgs.msg')


def load_what_tf2_loads() -> None:
    """
    Import what ``import tf2_ros`` imports.

    Public programs write ``rclpy.executors`` or ``geometry_msgs.msg`` after ``import rclpy`` or
    ``import geometry_msgs`` alone, which works because tf2_ros has imported the submodule.
    """
    for module in _LOADED:
        import_module(module)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME_OF:
        raise AttributeError(f"tf_tree_py's replacement of tf2 has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


# --- star imports

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
