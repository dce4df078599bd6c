# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The transform tree of ROS 2 in pure Python, with tf2's names and additional queries.

``BufferCore``, ``Pose`` and the exceptions do not need ROS. ``Buffer``, ``TransformListener``
and the broadcasters need rclpy. All of them are loaded when they are first used (PEP 562), so that
this import works without ROS and takes no time: a program handles signals only after it.
"""

import importlib
from importlib.util import find_spec
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:  # for type checkers; at runtime, __getattr__ below loads these names
    from tf_tree_py.beyond.corrections.anchor import Anchor, Sighting
    from tf_tree_py.beyond.corrections.blend import BlendLimits
    from tf_tree_py.beyond.curves.curve import ConstantTwist, Curve
    from tf_tree_py.beyond.curves.spline import Spline
    from tf_tree_py.beyond.curves.spline_fitter import SplineFitter
    from tf_tree_py.beyond.framed.framed_pose import FramedPoints, FramedPose, FrameMismatchError
    from tf_tree_py.beyond.freshness.ages import StaleException
    from tf_tree_py.beyond.motion.scans import deskew
    from tf_tree_py.beyond.motion.trajectory import POSE_COLUMNS, stamps_at_rate, trajectory
    from tf_tree_py.beyond.motion.twist import lookup_twist, lookup_twist_many
    from tf_tree_py.beyond.motion.uncertain_twist import lookup_twist_uncertain
    from tf_tree_py.beyond.uncertainty.gating import agreement, as_gtsam, from_gtsam
    from tf_tree_py.buffer_core import BufferCore, load, Snapshot
    from tf_tree_py.core import (
        as_seconds,
        ClockJumpException,
        ConnectivityException,
        EdgeInfo,
        ExtrapolationException,
        from_seconds,
        FutureExtrapolationException,
        Incident,
        Interpolation,
        InvalidArgumentException,
        LATEST,
        Linear,
        LookupException,
        NoDataException,
        PastExtrapolationException,
        Pose,
        Poses,
        RefusedException,
        se3,
        Statistics,
        TimeoutException,
        TransformException,
        TransformWarning,
        TreeFileError,
        UNLIMITED,
    )
    from tf_tree_py.health.doctor import Doctor
    from tf_tree_py.recording.flight_recorder import FlightRecorder
    from tf_tree_py.ros.buffer.interface import BufferInterface
    from tf_tree_py.ros.buffer.tf2_methods import velocity_stamped
    from tf_tree_py.ros.diagnostics import TransformDiagnostics
    from tf_tree_py.ros.filtering.message_filter import Drop, MessageFilter
    from tf_tree_py.ros.messages.convert import (
        as_nanoseconds,
        as_pose,
        time_message,
        transform_stamped,
    )
    from tf_tree_py.ros.messages.deskew_cloud import deskew_cloud
    from tf_tree_py.ros.messages.do_transform import as_matrix, as_points
    from tf_tree_py.ros.messages.registry import (
        convert,
        ConvertRegistration,
        NotImplementedException,
        Stamped,
        TransformRegistration,
        TypeException,
    )
    from tf_tree_py.ros.remote.buffer_client import BufferClient
    from tf_tree_py.ros.remote.buffer_server import BufferServer
    from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster
    from tf_tree_py.ros.topics.joining_buffer import Buffer
    from tf_tree_py.ros.topics.listener import TransformListener
    from tf_tree_py.ros.topics.pose_feed import PoseSample
    from tf_tree_py.ros.topics.shared_buffer import shared_buffer
    from tf_tree_py.ros.topics.side_topics import CovarianceListener, GyroListener
    from tf_tree_py.shared.errors import SharedTreeException
    from tf_tree_py.shared.shared_tree import SharedTree

__all__ = [
    'agreement', 'Anchor', 'as_gtsam', 'as_matrix', 'as_nanoseconds', 'as_points', 'as_pose',
    'as_seconds', 'BlendLimits', 'Buffer', 'BufferClient', 'BufferCore', 'BufferInterface',
    'BufferServer', 'ClockJumpException', 'ConnectivityException', 'ConstantTwist', 'convert',
    'ConvertRegistration', 'CovarianceListener', 'Curve', 'deskew', 'deskew_cloud', 'Doctor',
    'Drop', 'EdgeInfo', 'ExtrapolationException', 'FlightRecorder', 'FramedPoints', 'FramedPose',
    'FrameMismatchError', 'from_gtsam', 'from_seconds', 'FutureExtrapolationException',
    'GyroListener', 'Incident', 'Interpolation', 'InvalidArgumentException', 'LATEST', 'Linear',
    'load', 'lookup_twist', 'lookup_twist_many', 'lookup_twist_uncertain', 'LookupException',
    'MessageFilter', 'NoDataException', 'NotImplementedException', 'PastExtrapolationException',
    'Pose', 'POSE_COLUMNS', 'Poses', 'PoseSample', 'RefusedException', 'se3', 'shared_buffer',
    'SharedTree', 'SharedTreeException', 'Sighting', 'Snapshot', 'Spline', 'SplineFitter',
    'StaleException', 'Stamped', 'stamps_at_rate', 'StaticTransformBroadcaster', 'Statistics',
    'time_message', 'TimeoutException', 'trajectory', 'transform_stamped', 'TransformBroadcaster',
    'TransformDiagnostics', 'TransformException', 'TransformListener', 'TransformRegistration',
    'TransformWarning', 'TreeFileError', 'TypeException', 'UNLIMITED', 'velocity_stamped',
]

# The module of each name; all others are in core.
_LATER = dict.fromkeys(__all__, 'core') | {
    name: module for module, names in {
        'beyond.corrections.anchor': 'Anchor Sighting',
        'beyond.corrections.blend': 'BlendLimits',
        'beyond.curves.curve': 'ConstantTwist Curve',
        'beyond.curves.spline': 'Spline',
        'beyond.curves.spline_fitter': 'SplineFitter',
        'beyond.freshness.ages': 'StaleException',
        'beyond.framed.framed_pose': 'FramedPoints FramedPose FrameMismatchError',
        'beyond.motion.scans': 'deskew',
        'beyond.motion.trajectory': 'POSE_COLUMNS stamps_at_rate trajectory',
        'beyond.motion.twist': 'lookup_twist lookup_twist_many',
        'beyond.motion.uncertain_twist': 'lookup_twist_uncertain',
        'beyond.uncertainty.gating': 'agreement as_gtsam from_gtsam',
        'buffer_core': 'BufferCore load Snapshot',
        'health.doctor': 'Doctor',
        'recording.flight_recorder': 'FlightRecorder',
        'ros.buffer.interface': 'BufferInterface',
        'ros.buffer.tf2_methods': 'velocity_stamped',
        'ros.diagnostics': 'TransformDiagnostics',
        'ros.filtering.message_filter': 'Drop MessageFilter',
        'ros.messages.convert': 'as_nanoseconds as_pose time_message transform_stamped',
        'ros.messages.deskew_cloud': 'deskew_cloud',
        'ros.messages.do_transform': 'as_matrix as_points',
        'ros.messages.registry':
            'convert ConvertRegistration NotImplementedException Stamped '
            'TransformRegistration TypeException',
        'ros.remote.buffer_client': 'BufferClient',
        'ros.remote.buffer_server': 'BufferServer',
        'ros.topics.broadcaster': 'StaticTransformBroadcaster TransformBroadcaster',
        'ros.topics.joining_buffer': 'Buffer',
        'ros.topics.listener': 'TransformListener',
        'ros.topics.pose_feed': 'PoseSample',
        'ros.topics.shared_buffer': 'shared_buffer',
        'ros.topics.side_topics': 'CovarianceListener GyroListener',
        'shared.errors': 'SharedTreeException',
        'shared.shared_tree': 'SharedTree',
    }.items() for name in names.split()}


def _needs_ros(name: str) -> bool:
    return _LATER.get(name, '').startswith('ros.')


def _ros_is_here() -> bool:
    try:
        return find_spec('rclpy') is not None
    except ImportError:
        return False


# A star import loads all of these names, so those that need ROS are removed without ROS.
if not _ros_is_here():
    __all__[:] = [name for name in __all__ if not _needs_ros(name)]


def _version() -> str:
    # Imported here, because it is the slowest import of this file, and rarely needed.
    from importlib.metadata import PackageNotFoundError, version
    try:
        return version(__name__)
    except PackageNotFoundError:
        raise AttributeError(
            f'{__name__} is not installed, so its version is not known: pip install it, or build '
            'it with colcon') from None


def __getattr__(name: str) -> Any:
    if name == '__version__':
        return _version()
    if name in ('core', 'screws'):  # public modules, so `import tf_tree_py` suffices
        return importlib.import_module(f'tf_tree_py.{name}')
    if name not in _LATER:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    try:
        module = importlib.import_module(f'tf_tree_py.{_LATER[name]}')
    except ModuleNotFoundError as error:
        if not _needs_ros(name) or error.name is None or '.' in error.name:
            raise  # ROS is installed, but a part of it is missing.
        raise ImportError(
            f'tf_tree_py.{name} needs ROS 2, and {error.name} is not installed: source a ROS 2 '
            'installation, or run scripts/setup of the tf_tree_py repository, which installs one '
            'from PyPI'
        ) from error
    globals()[name] = value = getattr(module, name)  # so that this runs once
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
