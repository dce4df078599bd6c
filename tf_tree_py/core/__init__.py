# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2 in pure Python, without ROS: poses, histories, the tree and its buffer.

It imports nothing else of the package: read this first. The files in no room have stamps, errors,
locks, the texts of hints, and the shortening of long texts.
"""

from .buffer.plain_buffer import PlainBuffer
from .edges.interpolation import Interpolation, Linear
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
from .geometry.pose import Pose, Poses
from .messages import wire
from .messages.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from .messages.sample import Sample
from .stamp import as_seconds, from_seconds, LATEST, UNLIMITED
from .tree.edge_info import EdgeInfo
from .tree.path import COMPILED
from .tree.queries import PlainSnapshot

__all__ = [
    'as_seconds',
    'ClockJumpException',
    'COMPILED',
    'ConnectivityException',
    'EdgeInfo',
    'ExtrapolationException',
    'from_seconds',
    'FutureExtrapolationException',
    'Incident',
    'Interpolation',
    'InvalidArgumentException',
    'Kind',
    'LATEST',
    'Linear',
    'LookupException',
    'NoDataException',
    'PastExtrapolationException',
    'PlainBuffer',
    'PlainSnapshot',
    'Pose',
    'Poses',
    'RefusedException',
    'Sample',
    'se3',
    'Statistics',
    'TimeoutException',
    'TransformException',
    'TransformWarning',
    'TreeFileError',
    'UNLIMITED',
    'wire',
]
