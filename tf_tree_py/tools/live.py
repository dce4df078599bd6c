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

"""A live tree: what arrives on /tf and /tf_static, heard by a node of the tool's own."""

from argparse import Namespace
from collections.abc import Sequence
from functools import partial
import threading

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.logging import LoggingSeverity
from rclpy.signals import SignalHandlerOptions
from tf_tree_py.core.arrivals.estimate import STATIC_COVARIANCE_TOPIC
from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.arrivals.received import Endpoint
from tf_tree_py.core.buffer.deadline import WallDeadline
from tf_tree_py.core.telling.made_way import DIAGNOSTICS_TOPIC, Hearsay
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.threads.companion import node_of_its_own
from tf_tree_py.ros.topics.covariances import CovarianceListener
from tf_tree_py.ros.topics.endpoints import endpoints_of
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.topics.qos import sensor_qos, TF_STATIC_TOPIC, TF_TOPIC
from tf_tree_py.ros.topics.side_topics import SideTopics

from .endings import Cannot

# How long what is told once may take longer than the first transforms, and how often to look.
_MOMENT_S = 1.0
_GLANCE_S = 0.02


class Live:
    """
    A buffer that hears a running system; see ``source.TreeSource``.

    :ivar node: the tool's node, with a hidden name; nobody spins it.
    """

    hint = 'does anybody publish there, with the same ROS_DOMAIN_ID?'

    def __init__(self, arguments: Namespace, name: str, observers: Sequence[Observer]) -> None:
        """
        Begin to listen.

        :raises Cannot: ROS does not understand its arguments.
        """
        try:
            rclpy.init(args=[name, *arguments.ros_arguments],
                       signal_handler_options=SignalHandlerOptions.NO)
            self.node = node_of_its_own(name)
        except Exception as error:  # noqa: B902 - rcl raises several kinds, for what was typed
            rclpy.try_shutdown()
            raise Cannot(_sentence(error)) from error
        # What is refused or odd is the tool's to tell.
        self.node.get_logger().set_level(LoggingSeverity.ERROR)
        self.buffer = Buffer()
        for observer in observers:
            self.buffer.observers.add(observer)
        moving = self._resolved(arguments.tf_topic or TF_TOPIC)
        fixed = self._resolved(arguments.tf_static_topic or TF_STATIC_TOPIC)
        self._topics = {moving: False, fixed: True}
        # First, so that what is told once may be here when the first lookup has an answer.
        self._static_covariances = self._resolved(STATIC_COVARIANCE_TOPIC)
        self._covariances = CovarianceListener(self.buffer, self.node)
        self._listener = TransformListener(
            self.buffer, self.node, tf_topic=moving, tf_static_topic=fixed)
        self._diagnostics = SideTopics(self, self.node, 'diagnostics_impl')
        self._diagnostics.subscribe(
            DiagnosticArray, DIAGNOSTICS_TOPIC, partial(_hear, Hearsay(), self.buffer),
            sensor_qos())
        self.name = ' and '.join(self._topics)
        self.now = self.buffer.now

    def __enter__(self) -> 'Live':
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()
        self._covariances.close()
        self._diagnostics.close()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def _resolved(self, topic: str) -> str:
        """Return a topic's full name, remapped."""
        try:
            return self.node.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - likewise
            rclpy.try_shutdown()
            raise Cannot(f'{topic!r} is no topic: {_sentence(error)}') from error

    def watch(self, seconds: float | None) -> bool:
        """Let transforms arrive, in the listener's thread."""
        threading.Event().wait(seconds)
        return True

    def await_covariances(self) -> None:
        """Wait a moment for those of static edges, if the graph says that somebody tells any."""
        deadline = WallDeadline(_MOMENT_S)
        while (not self.buffer.has_covariances and deadline.elapsed_s() < _MOMENT_S
               and self.node.count_publishers(self._static_covariances)):
            threading.Event().wait(_GLANCE_S)  # nothing wakes anybody when a covariance comes

    def endpoints(self) -> list[Endpoint]:
        """Return who publishes and hears the topics, this tool too, as the graph says."""
        return endpoints_of(self.node, self._topics)

    def damage(self) -> list[str]:
        """Return nothing: what cannot be read is told to the observers."""
        return []


def _hear(hearsay: Hearsay, buffer: Buffer, message: DiagnosticArray) -> None:
    """Tell who watches what a buffer elsewhere says of its sources."""
    for status in message.status:
        for incident in hearsay.news(
                status.name, {pair.key: pair.value for pair in status.values}):
            buffer.intake.refuse(incident)


def _sentence(error: Exception) -> str:
    """Return the text of an rcl error, without file names and line numbers."""
    text = str(error).split(', at /')[0].strip()
    # For unknown arguments its text is their list and nothing else.
    return f'unknown ROS arguments {text}' if text.startswith('[') else ' '.join(text.split())
