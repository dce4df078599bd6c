# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sensor messages from a bag."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
import threading
from typing import NamedTuple

import numpy as np
from tf_tree_py.bag import Bag, Connection
from tf_tree_py.bag.files.connections import cursor_of, decode
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.times import Stamps

from .readings import is_known, Reading, reading_of, Sensors

# Messages stay in memory as bytes. Of a topic with more bytes, only every second message is kept,
# or every fourth, and so on.
_MOST_BYTES = 1 << 29


class _Topic(NamedTuple):
    """The messages of one topic, sorted by the stamps of their headers."""

    stamps: Stamps
    messages: list[tuple[Connection, bytes]]


class RecordedSensors(Sensors):
    """
    The sensor messages of one bag. A topic is read on first use.

    The messages of a released topic are kept: it may be wanted again.
    """

    def __init__(self, path: Path, described: Callable[[str], None] | None = None) -> None:
        """
        List the topics of a bag.

        :param described: is called with the last robot description in the bag; None: do not
            look for descriptions.
        :raises BagError: the bag cannot be read.
        """
        self._path = path
        self._lock = threading.Lock()
        self._read: dict[str, _Topic] = {}
        with Bag(path, []) as bag:
            self._types = {connection.topic: connection.type_name for connection in bag.everything
                           if is_known(connection.type_name) and connection.is_of_ros}
            text = _description_in(bag) if described is not None else None
        if text is not None and described is not None:
            described(text)

    def topics(self) -> list[str]:
        """Return the topics whose messages can be shown."""
        return sorted(self._types)

    def want(self, topic: str, reader: object) -> None:
        """Read a topic, unless that has been done already."""
        with self._lock:
            if topic not in self._read and topic in self._types:
                self._read[topic] = _read(self._path, topic)

    def close(self) -> None:
        """Release the memory."""
        self._read.clear()

    def trail(self, topic: str, stamp: int, most: int) -> list[Reading]:
        """Return the last readings of a topic that are not later than a stamp, oldest first."""
        known = self._read.get(topic)
        if known is None:
            return []
        end = int(known.stamps.searchsorted(stamp, 'right'))
        readings = [decoded(*known.messages[place]) for place in range(max(end - most, 0), end)]
        return [reading for reading in readings if reading is not None]


def _description_in(bag: Bag) -> str | None:
    """Return the last robot description in a bag."""
    text = None
    for each in bag.everything:
        if (each.topic.endswith('/robot_description') and each.type_name.endswith('String')
                and each.is_of_ros):
            for message in bag.messages(each.topic):
                text = _text_of(each, message.data) or text
    return text


def _text_of(connection: Connection, data: bytes) -> str:
    """Return the text of a std_msgs/String; empty if the bytes are damaged."""
    try:
        return str(decode(connection, data).data)
    except WireError:
        return ''


def _read(path: Path, topic: str) -> _Topic:
    found: list[tuple[int, Connection, bytes]] = []
    size, stride, number = 0, 1, 0
    with Bag(path, []) as bag:
        for message in bag.messages(topic):
            number += 1
            if number % stride:
                continue
            stamp = _stamp_of(message.connection, message.data)
            if stamp is None:
                continue
            found.append((stamp, message.connection, message.data))
            size += len(message.data)
            if size > _MOST_BYTES:
                found, stride, size = found[::2], stride * 2, size // 2
    found.sort(key=lambda each: each[0])
    return _Topic(np.array([stamp for stamp, _, _ in found], np.int64),
                  [(connection, data) for _, connection, data in found])


def _stamp_of(connection: Connection, data: bytes) -> int | None:
    """Return the stamp of the header at the beginning of a message; None if there is none."""
    try:
        return cursor_of(data, connection.ros1).read_stamp()
    except WireError:
        return None


@lru_cache(maxsize=512)
def decoded(connection: Connection, data: bytes) -> Reading | None:
    """Return what a message shows; None: messages of its type cannot be shown."""
    try:
        message = decode(connection, data)
    except WireError as error:
        return Reading('', _stamp_of(connection, data) or 0, np.empty((0, 3)), problem=str(error))
    return reading_of(connection.type_name, message)
