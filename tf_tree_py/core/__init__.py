"""The transform tree without ROS: poses, histories, the tree and its buffer."""

from .arrivals.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from .arrivals.sample import Sample
from .buffer.buffer_core import BufferCore
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
    'Statistics',
    'TimeoutException',
    'TransformException',
    'TransformWarning',
    'TreeFileError',
    'UNLIMITED',
]
