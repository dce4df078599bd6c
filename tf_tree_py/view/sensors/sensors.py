# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The sensor messages that a page shows."""

from bisect import bisect_right
from collections import deque
import threading

from .readings import Reading


class Sensors:
    """
    Sensor messages. Only topics that a page wants are read.

    This one has no topics; those of a bag and of a running system derive from it.
    """

    def topics(self) -> list[str]:
        """Return the topics whose messages can be shown."""
        return []

    def want(self, topic: str, reader: object) -> None:
        """Start reading a topic for a reader."""

    def release(self, topic: str, reader: object) -> None:
        """Stop reading a topic for a reader."""

    def reading(self, topic: str, stamp: int) -> Reading | None:
        """Return the newest reading of a topic that is not later than a stamp, if any."""
        return next(iter(self.trail(topic, stamp, 1)), None)

    def trail(self, topic: str, stamp: int, most: int) -> list[Reading]:
        """Return the last readings of a topic that are not later than a stamp, oldest first."""
        return []

    def close(self) -> None:
        """Stop reading all topics."""


class Recent:
    """The last readings of one subscription."""

    def __init__(self, most: int) -> None:
        """
        Begin without readings.

        :param most: the number of readings to keep.
        """
        self._lock = threading.Lock()
        self._kept: deque[Reading] = deque(maxlen=most)

    def add(self, reading: Reading) -> None:
        """Add a reading."""
        with self._lock:
            self._kept.append(reading)

    def until(self, stamp: int, most: int) -> list[Reading]:
        """Return the last readings that are not later than a stamp, oldest first."""
        with self._lock:
            kept = sorted(self._kept, key=lambda reading: reading.stamp)
        end = bisect_right(kept, stamp, key=lambda reading: reading.stamp)
        return kept[max(end - most, 0):end]
