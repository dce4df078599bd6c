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

"""The transform tree without ROS: poses, histories, the tree and its buffer."""

from .arrivals.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from .arrivals.sample import Sample
from .buffer.buffer_core import BufferCore
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
from .geometry.pose import Pose
from .stamp import from_seconds, LATEST, UNLIMITED
from .tree.outline import EdgeInfo
from .tree.queries import load, Snapshot
from .twist import lookup_twist, lookup_twist_many

__all__ = [
    'BufferCore',
    'ClockJumpException',
    'ConnectivityException',
    'EdgeInfo',
    'ExtrapolationException',
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
