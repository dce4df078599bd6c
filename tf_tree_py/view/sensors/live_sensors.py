# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sensor messages and the robot's description from the topics of a running system."""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.util import find_spec
import threading
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from tf_tree_py.ros.topics.qos import sensor_qos, static_listener_qos
from tf_tree_py.ros.topics.side_topics import SideTopics

from .readings import is_known, Reading, reading_of, Recent, Sensors

_KEPT = 300
_DESCRIBED = 'robot_description'


class LiveSensors(Sensors):
    """
    The sensor messages of topics.

    A subscription exists only while a page wants its topic.
    """

    def __init__(self, node: Node, described: Callable[[str], None] | None = None) -> None:
        """
        Subscribe to the robot's description only.

        :param node: whose namespace and remappings to use.
        :param described: is called with each description; None: do not subscribe to it.
        """
        self._node = node
        self._lock = threading.Lock()
        self._numbers = 0
        self._types: dict[str, str] = {}
        self._wanted: dict[str, set[object]] = {}
        # Each has a thread of its own, so that a large cloud does not delay a scan.
        self._subscriptions: dict[str, SideTopics] = {}
        self._recent: dict[str, Recent] = {}
        if described is not None:
            self._subscriptions[''] = self._subscribe(
                String, _DESCRIBED, lambda message: described(message.data), static_listener_qos())

    def topics(self) -> list[str]:
        """Return the topics whose messages can be shown."""
        self._types = {topic: types[0] for topic, types in self._node.get_topic_names_and_types()
                       if is_known(types[0]) and find_spec(types[0].partition('/')[0])}
        return sorted(self._types)

    def want(self, topic: str, reader: object) -> None:
        """Subscribe to a topic, unless that has been done already."""
        with self._lock:
            self._wanted.setdefault(topic, set()).add(reader)
            if topic in self._subscriptions or topic not in self._types:
                return
            self._recent[topic] = Recent(_KEPT)
            self._subscriptions[topic] = self._subscribe(
                _type_of(self._types[topic]), topic,
                partial(_keep, self._types[topic], self._recent[topic]), sensor_qos())

    def release(self, topic: str, reader: object) -> None:
        """Release a topic; without other readers, end its subscription."""
        with self._lock:
            readers = self._wanted.get(topic, set())
            readers.discard(reader)
            if not readers and topic in self._subscriptions:
                self._subscriptions.pop(topic).close()
                self._recent.pop(topic)

    def trail(self, topic: str, stamp: int, most: int) -> list[Reading]:
        """Return the last readings of a topic that are not later than a stamp, oldest first."""
        recent = self._recent.get(topic)
        return [] if recent is None else recent.until(stamp, most)

    def close(self) -> None:
        """End all subscriptions."""
        with self._lock:
            for subscription in self._subscriptions.values():
                subscription.close()
            self._subscriptions.clear()

    def _subscribe(self, msg_type: type, topic: str, callback: Callable[[Any], None],
                   qos: QoSProfile) -> SideTopics:
        self._numbers += 1
        side = SideTopics(self, self._node, f'sensor_{self._numbers}_impl')
        side.subscribe(msg_type, topic, callback, qos)
        return side


def _type_of(name: str) -> Any:
    package, *_, message = name.split('/')
    return getattr(import_module(f'{package}.msg'), message)


def _keep(type_name: str, recent: Recent, message: object) -> None:
    reading = reading_of(type_name, message)
    if reading is not None:
        recent.add(reading)
