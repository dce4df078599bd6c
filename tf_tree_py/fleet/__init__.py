# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The transforms of many robots, over Zenoh and without ROS.

The messages' bytes and the tree are handled by ``core``, and the network by Zenoh (``pip install
eclipse-zenoh``).
"""

from .listener import FleetListener
from .robot_publisher import RobotPublisher
from .roster import FleetRobot
from .session import close_session, configuration, FleetError, open_session
from .trust import RobotQuota

__all__ = [
    'close_session',
    'configuration',
    'FleetError',
    'FleetListener',
    'FleetRobot',
    'open_session',
    'RobotPublisher',
    'RobotQuota',
]
