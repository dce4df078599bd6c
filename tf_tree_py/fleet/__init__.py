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
