# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The transform tree without ROS: poses, histories, the tree and its buffer."""

from .buffer.buffer_core import BufferCore, load, Snapshot
from .edges.constant_twist import ConstantTwist
from .edges.curve import Curve
from .edges.spline import Spline
from .edges.spline_fitter import SplineFitter
from .errors import (
    ClockJumpException,
    ConnectivityException,
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    TimeoutException,
    TransformException,
    TreeFileError,
)
from .geometry import se3
from .geometry.framed_pose import FramedPoints, FramedPose, FrameMismatchError
from .geometry.many_poses import Poses
from .geometry.pose import Pose
from .ingest.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from .ingest.sample import Sample
from .stamp import from_seconds, LATEST, UNLIMITED
from .tree.outline import EdgeInfo
from .twist import lookup_twist, lookup_twist_many

__all__ = [
    'BufferCore',
    'ClockJumpException',
    'ConnectivityException',
    'ConstantTwist',
    'Curve',
    'EdgeInfo',
    'ExtrapolationException',
    'FramedPoints',
    'FramedPose',
    'FrameMismatchError',
    'from_seconds',
    'FutureExtrapolationException',
    'Incident',
    'InvalidArgumentException',
    'Kind',
    'LATEST',
    'load',
    'lookup_twist',
    'lookup_twist_many',
    'LookupException',
    'NoDataException',
    'PastExtrapolationException',
    'Pose',
    'Poses',
    'RefusedException',
    'Sample',
    'se3',
    'Snapshot',
    'Spline',
    'SplineFitter',
    'Statistics',
    'TimeoutException',
    'TransformException',
    'TransformWarning',
    'TreeFileError',
    'UNLIMITED',
]
