# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Mountings and time offsets, estimated from observations without ROS.

Reading messages of a running system, and printing results, are in ``tools``.
"""

from .calibrating import calibrate
from .errors import CalibrationError
from .observability import Limits, Unobservable
from .observations import Observations
from .recorded import recorded_observations
from .result import Calibration, EdgeEstimate, Outlier, TimeOffset
from .verdict import Explanation, Verdict

__all__ = [
    'calibrate',
    'Calibration',
    'CalibrationError',
    'EdgeEstimate',
    'Explanation',
    'Limits',
    'Observations',
    'Outlier',
    'recorded_observations',
    'TimeOffset',
    'Unobservable',
    'Verdict',
]
