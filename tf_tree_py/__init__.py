# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The transform tree of ROS 2 in pure Python, with tf2's names and additional queries.

``BufferCore``, ``Pose`` and the exceptions do not need ROS. ``Buffer``, ``TransformListener``
and the broadcasters need rclpy, and are loaded when they are first used (PEP 562), so that this
import works without it.
"""

import importlib
from importlib.util import find_spec
from typing import Any, TYPE_CHECKING

from tf_tree_py.beyond.curves.constant_twist import ConstantTwist
from tf_tree_py.beyond.curves.curve import Curve
from tf_tree_py.beyond.curves.spline import Spline
from tf_tree_py.beyond.curves.spline_fitter import SplineFitter
from tf_tree_py.beyond.framed.framed_pose import FramedPoints, FramedPose, FrameMismatchError
from tf_tree_py.beyond.motion.deskew import deskew
from tf_tree_py.beyond.motion.twist import lookup_twist, lookup_twist_many
from tf_tree_py.buffer_core import BufferCore, load, Snapshot
from tf_tree_py.core import (
    ClockJumpException,
    ConnectivityException,
    EdgeInfo,
    ExtrapolationException,
    from_seconds,
    FutureExtrapolationException,
    Incident,
    InvalidArgumentException,
    LATEST,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    Pose,
    Poses,
    RefusedException,
    Statistics,
    TimeoutException,
    TransformException,
    TransformWarning,
    TreeFileError,
    UNLIMITED,
)
from tf_tree_py.core.geometry import se3
from tf_tree_py.deprecation import moved, renamed
from tf_tree_py.health.flight_recorder import FlightRecorder

if TYPE_CHECKING:  # for type checkers; at runtime, _load below loads these names
    from tf_tree_py.ros.buffer.buffer import Buffer
    from tf_tree_py.ros.buffer.interface import BufferInterface
    from tf_tree_py.ros.buffer.twists import velocity_stamped
    from tf_tree_py.ros.diagnostics import TransformDiagnostics
    from tf_tree_py.ros.filtering.message_filter import Drop, MessageFilter
    from tf_tree_py.ros.messages.arrays import as_matrix, as_points
    from tf_tree_py.ros.messages.convert import as_pose
    from tf_tree_py.ros.messages.deskew_cloud import deskew_cloud
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
    from tf_tree_py.ros.topics.covariances import CovarianceListener
    from tf_tree_py.ros.topics.gyro import GyroListener
    from tf_tree_py.ros.topics.listener import TransformListener
    from tf_tree_py.ros.topics.shared_buffer import shared_buffer

# The present name for each old one; docs/stability.md says how long an old name is kept.
_OLD_NAMES: dict[str, str] = {}

# What was public in tf_tree_py.core before core became tf2 and nothing else.
_MOVED_FROM_CORE = {
    'BufferCore', 'ConstantTwist', 'Curve', 'FramedPoints', 'FramedPose', 'FrameMismatchError',
    'load', 'lookup_twist', 'lookup_twist_many', 'Snapshot', 'Spline', 'SplineFitter'}

# The module of the ROS layer for each name.
_ROS_NAMES = {
    'as_matrix': 'messages.arrays',
    'as_points': 'messages.arrays',
    'as_pose': 'messages.convert',
    'Buffer': 'buffer.buffer',
    'BufferClient': 'remote.buffer_client',
    'BufferInterface': 'buffer.interface',
    'BufferServer': 'remote.buffer_server',
    'convert': 'messages.registry',
    'ConvertRegistration': 'messages.registry',
    'CovarianceListener': 'topics.covariances',
    'deskew_cloud': 'messages.deskew_cloud',
    'Drop': 'filtering.message_filter',
    'GyroListener': 'topics.gyro',
    'MessageFilter': 'filtering.message_filter',
    'NotImplementedException': 'messages.registry',
    'shared_buffer': 'topics.shared_buffer',
    'Stamped': 'messages.registry',
    'StaticTransformBroadcaster': 'topics.broadcaster',
    'TransformBroadcaster': 'topics.broadcaster',
    'TransformDiagnostics': 'diagnostics',
    'TransformListener': 'topics.listener',
    'TransformRegistration': 'messages.registry',
    'TypeException': 'messages.registry',
    'velocity_stamped': 'buffer.twists',
}

__all__ = [
    'as_matrix',
    'as_points',
    'as_pose',
    'Buffer',
    'BufferClient',
    'BufferCore',
    'BufferInterface',
    'BufferServer',
    'ClockJumpException',
    'ConnectivityException',
    'ConstantTwist',
    'convert',
    'ConvertRegistration',
    'CovarianceListener',
    'Curve',
    'deskew',
    'deskew_cloud',
    'Drop',
    'EdgeInfo',
    'ExtrapolationException',
    'FlightRecorder',
    'FramedPoints',
    'FramedPose',
    'FrameMismatchError',
    'from_seconds',
    'FutureExtrapolationException',
    'GyroListener',
    'Incident',
    'InvalidArgumentException',
    'LATEST',
    'load',
    'lookup_twist',
    'lookup_twist_many',
    'LookupException',
    'MessageFilter',
    'NoDataException',
    'NotImplementedException',
    'PastExtrapolationException',
    'Pose',
    'Poses',
    'RefusedException',
    'se3',
    'shared_buffer',
    'Snapshot',
    'Spline',
    'SplineFitter',
    'Stamped',
    'StaticTransformBroadcaster',
    'Statistics',
    'TimeoutException',
    'TransformBroadcaster',
    'TransformDiagnostics',
    'TransformException',
    'TransformListener',
    'TransformRegistration',
    'TransformWarning',
    'TreeFileError',
    'TypeException',
    'UNLIMITED',
    'velocity_stamped',
]


def _ros_is_here() -> bool:
    try:
        return find_spec('rclpy') is not None
    except ImportError:
        return False


# A star import loads all of these names, so those that need ROS are removed without ROS.
if not _ros_is_here():
    __all__[:] = [name for name in __all__ if name not in _ROS_NAMES]


def _version() -> str:
    # Imported here, because it is the slowest import of this file, and rarely needed.
    from importlib.metadata import PackageNotFoundError, version
    try:
        return version(__name__)
    except PackageNotFoundError:
        raise AttributeError(
            f'{__name__} is not installed, so its version is not known: pip install it, or build '
            'it with colcon') from None


def _load(name: str) -> Any:
    if name == '__version__':
        return _version()
    if name not in _ROS_NAMES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    try:
        module = importlib.import_module(f'tf_tree_py.ros.{_ROS_NAMES[name]}')
    except ModuleNotFoundError as error:
        if error.name is None or '.' in error.name:
            raise  # ROS is installed, but a part of it is missing.
        raise ImportError(
            f'tf_tree_py.{name} needs ROS 2, and {error.name} is not installed: source a ROS 2 '
            'installation, or run scripts/setup of the tf_tree_py repository, which installs one '
            'from PyPI'
        ) from error
    return getattr(module, name)


__getattr__ = renamed(__name__, _OLD_NAMES, until='0.3', otherwise=_load)
moved('tf_tree_py.core', _MOVED_FROM_CORE, __name__, until='0.3')


def __dir__() -> list[str]:
    return sorted(__all__)
