"""The transform tree without ROS: poses, histories, the tree and its buffer."""

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
from .incidents import Incident, Kind, Statistics
from .pose import Pose
from .queries import EdgeInfo, Snapshot
from .sample import Sample
from .stamp import LATEST

__all__ = [
    'LATEST',
    'BufferCore',
    'ClockJumpException',
    'ConnectivityException',
    'EdgeInfo',
    'ExtrapolationException',
    'FutureExtrapolationException',
    'Incident',
    'InvalidArgumentException',
    'Kind',
    'LookupException',
    'NoDataException',
    'PastExtrapolationException',
    'Pose',
    'Sample',
    'Snapshot',
    'Statistics',
    'TimeoutException',
    'TransformException',
]
