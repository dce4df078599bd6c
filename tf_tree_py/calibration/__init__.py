# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Mountings and time offsets, estimated from observations without ROS.

Reading messages of a running system, and printing results, are in ``tools``.
"""

from .at_rest import Contradiction
from .calibrating import calibrate
from .detections import recorded_observations
from .observations import CalibrationError, Limits, Observations
from .unobservable import Unobservable
from .verdict import Calibration, EdgeEstimate, Explanation, Outlier, TimeOffset, Verdict

__all__ = [
    'calibrate',
    'Calibration',
    'CalibrationError',
    'Contradiction',
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
