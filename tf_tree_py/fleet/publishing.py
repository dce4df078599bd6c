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

"""A robot's transforms into Zenoh, as a ``FleetListener`` hears them: without ROS."""

from typing import Any, TYPE_CHECKING

from .keys import check_prefix, check_robot, key_of, token_of, Topic
from .session import needs_zenoh

if TYPE_CHECKING:
    import zenoh

# How often a publisher tells the number of its last message, so that a lost one is missed.
_HEARTBEAT_S = 1.0
DEFAULT_HISTORY = 200
"""Messages of what moves that are kept for whoever comes late: ten seconds at 20 Hz."""


class RobotPublisher:
    """
    Sends a robot's transforms, and says that it is there as long as it is open.

    What moves may be lost on a slow link, and is then asked for again while it is kept.
    Static transforms wait until they are sent, and the last message of them is kept for good:
    so each has to hold all of the robot's static transforms. May be used from any thread. A
    context manager.
    """

    def __init__(self, session: 'zenoh.Session', robot: str, *, key_prefix: str = '',
                 history: int = DEFAULT_HISTORY) -> None:
        """
        Say that a robot is there.

        :param session: an open session of Zenoh, which stays open: see ``open_session``.
        :param robot: its name, as a part of keys.
        :param key_prefix: what stands in front of it in keys.
        :param history: how many messages of what moves are kept for whoever comes late.
        :raises FleetError: no key can have this name.
        """
        self.robot, prefix = check_robot(robot), check_prefix(key_prefix)
        zenoh = needs_zenoh()
        self._moving = _publisher(session, key_of(Topic(self.robot, False), prefix), history,
                                  zenoh.CongestionControl.DROP)
        self._static = _publisher(session, key_of(Topic(self.robot, True), prefix), 1,
                                  zenoh.CongestionControl.BLOCK)
        # Last, so that whoever sees it can hear the robot.
        token = session.liveliness().declare_token(token_of(self.robot, prefix))
        self._declared: list[Any] = [token, self._moving, self._static]

    def send(self, data: bytes) -> None:
        """Send what moves: a TFMessage as ``core.arrivals.wire`` writes it."""
        self._moving.put(data)

    def send_static(self, data: bytes) -> None:
        """Send all of the robot's static transforms, as one TFMessage."""
        self._static.put(data)

    def close(self) -> None:
        """Say that the robot has gone; nothing is kept any longer."""
        declared, self._declared = self._declared, []
        for one in declared:
            one.undeclare()

    def __enter__(self) -> 'RobotPublisher':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _publisher(session: 'zenoh.Session', key: str, history: int, congestion: Any) -> Any:
    """Return a publisher whose last messages are kept, and asked for again where they are lost."""
    zenoh, ext = needs_zenoh(), needs_zenoh('zenoh.ext')
    return ext.declare_advanced_publisher(
        session, key, congestion_control=congestion, reliability=zenoh.Reliability.RELIABLE,
        cache=ext.CacheConfig(max_samples=history), publisher_detection=True,
        sample_miss_detection=ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S))
