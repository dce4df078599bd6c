"""
The transforms of many robots, over Zenoh and without ROS.

Not here: the bytes of messages and the tree, which are ``core``'s, and the network, which
Zenoh is (``pip install 'tf_tree_py[fleet]'``).
"""

from .errors import FleetError
from .listener import FleetListener
from .publishing import RobotPublisher
from .roster import Robot
from .session import configuration, open_session

__all__ = [
    'configuration',
    'FleetError',
    'FleetListener',
    'open_session',
    'Robot',
    'RobotPublisher',
]
