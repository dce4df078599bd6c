# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A subscriber of a fleet: ``python -m benchmark.processes.fleet_subscriber WAY ROUTER``.

WAY is one of ``WAYS``. The main thread only waits for commands; Zenoh's threads receive the
messages.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
import itertools
import sys
import time
from typing import Any

from tf_tree_py.fleet import configuration, FleetListener, open_session
import zenoh

from ..rows import BY_HAND, OURS, PLAIN_ZENOH
from ..worker import serve

# Threads that look up new data; each waits most of the time.
_LOOKING = 8


class OurSubscriber:
    """``FleetListener``, all robots in one buffer."""

    def __init__(self, router: str) -> None:
        self._listener = FleetListener(router)
        self.close = self._listener.close

    def taken(self) -> int:
        """Return the number of inserted transforms, including static ones."""
        return self._listener.buffer.statistics().accepted

    def lags(self, robots: int, leaf: str, seconds: float) -> list[float]:
        """
        Return the delays from the publication of some messages to lookups, milliseconds.

        :param leaf: the last moving frame of each robot.
        """
        end = time.monotonic() + seconds
        with ThreadPoolExecutor(_LOOKING) as pool:
            found = pool.map(lambda first: self._look(
                [f'robot{number}/{leaf}' for number in range(first, robots, _LOOKING)], end),
                range(min(robots, _LOOKING)))
        return list(itertools.chain(*found))

    def _look(self, frames: list[str], end: float) -> list[float]:
        """Look up the newest pose of each frame in turn, as soon as it arrives."""
        buffer = self._listener.buffer
        lags: list[float] = []
        for frame in itertools.cycle(frames):
            if time.monotonic() > end:
                return lags
            try:
                newest = buffer.latest_common_time('map', frame)
                buffer.lookup_within(1.0, 'map', frame, newest + 1)
            except Exception:  # noqa: B902 - it has not begun yet, or has ended
                continue
            lags.append((time.time_ns() - buffer.latest_common_time('map', frame)) / 1e6)
        return lags


class PlainSubscriber:
    """A plain subscription whose callback only counts."""

    def __init__(self, router: str) -> None:
        self._count = 0
        self._session: Any = open_session(configuration(router), 10.0)
        self.close = self._session.close
        self._subscriber = self._session.declare_subscriber('*/tf', self._receive)

    def _receive(self, _: zenoh.Sample) -> None:
        self._count += 1

    def taken(self) -> int:
        """Return the number of messages that arrived."""
        return self._count


class SubscriberByHand(PlainSubscriber):
    """Deserializes messages and inserts their transforms one by one, like common code."""

    def __init__(self, router: str) -> None:
        from rclpy.serialization import deserialize_message
        from tf2_msgs.msg import TFMessage
        from tf_tree_py import Buffer
        self._buffer = Buffer()
        self._deserialize: Any = lambda data: deserialize_message(data, TFMessage)
        super().__init__(router)

    def _receive(self, sample: zenoh.Sample) -> None:
        robot = str(sample.key_expr).partition('/')[0]
        for transform in self._deserialize(sample.payload.to_bytes()).transforms:
            if transform.header.frame_id != 'map':
                transform.header.frame_id = f'{robot}/{transform.header.frame_id}'
            transform.child_frame_id = f'{robot}/{transform.child_frame_id}'
            self._buffer.set_transform(transform, robot)
        self._count += 1


WAYS: dict[str, type[OurSubscriber] | type[PlainSubscriber]] = {
    OURS: OurSubscriber, PLAIN_ZENOH: PlainSubscriber, BY_HAND: SubscriberByHand}


def main(way: str, router: str) -> None:
    """Subscribe in one way, and execute commands."""
    with closing(WAYS[way](router)) as subscriber:
        serve({'cpu_s': time.process_time, 'taken': subscriber.taken,
               **({'lags': subscriber.lags} if isinstance(subscriber, OurSubscriber) else {})})


if __name__ == '__main__':
    main(*sys.argv[1:])
