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

"""A robot's topics of transforms, listened to: what no buffer would take stays out."""

from collections.abc import Callable

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.frame_names import Rename
from tf_tree_py.core.arrivals.incident_log import IncidentLog
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.sample import bad_name, Batch, checked, Sample
from tf_tree_py.core.arrivals.wire import WireReader
from tf_tree_py.core.buffer.buffer_core import DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.departures.sending import Moving, Static
from tf_tree_py.ros.threads.companion import companion
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics.authority import Authority
from tf_tree_py.ros.topics.qos import dynamic_qos, static_listener_qos


class RobotTopics:
    """Listens to a robot in a thread of its own, and hands over what arrives."""

    def __init__(self, node: Node, names: Rename) -> None:
        """
        Begin to listen to nothing.

        :param names: renames edges, or leaves them out.
        """
        self._names = names
        self._log = IncidentLog(node.get_logger())
        self._home = companion(node, f'{node.get_name()}_impl')

    def listen(self, topic: str, static_topic: str, moving: Moving, static: Static) -> Receiver:
        """
        Hand over what comes on two topics, until the receiver is closed or ROS ends.

        :param moving: gets what comes on the first, and is closed at the end.
        """
        self._subscribe(topic, dynamic_qos(), moving.take)
        self._subscribe(static_topic, static_listener_qos(), static.take)
        return Receiver(self._home, moving.close)

    def _subscribe(self, topic: str, qos: QoSProfile,
                   take: Callable[[list[Sample]], None]) -> None:
        reader, authority = WireReader(self._names), Authority(self._home, topic)

        def receive(data: bytes) -> None:
            publisher = authority.name()
            batch = reader.read_or_refuse(data, publisher)
            if isinstance(batch, Incident):
                self._log.report([batch])
            else:
                take(fit_samples(batch, publisher, self._log.report))

        self._home.create_subscription(TFMessage, topic, receive, qos, raw=True)


def fit_samples(batch: Batch, publisher: str,
                report: Callable[[list[Incident]], object] = lambda refused: None
                ) -> list[Sample]:
    """Return the samples that a buffer would take, and report why it would refuse the others."""
    judged = [_fit(sample, publisher) for sample in batch.samples()]
    report([each for each in judged if isinstance(each, Incident)])
    return [each for each in judged if isinstance(each, Sample)]


def _fit(sample: Sample, publisher: str) -> Sample | Incident:
    bad = bad_name(sample.parent, sample.child, sample.stamp, publisher, DEFAULT_MAX_NAME_BYTES)
    return bad or checked(sample, publisher)
