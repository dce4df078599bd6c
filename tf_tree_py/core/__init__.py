"""The transform tree without ROS: poses, histories, the tree and its buffer."""

from . import se3
from .buffer_core import BufferCore
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
)
from .incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from .outline import EdgeInfo
from .pose import Pose
from .queries import Snapshot
from .sample import Sample
from .stamp import from_seconds, LATEST, UNLIMITED
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
    'UNLIMITED',
]
