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
Somebody who hears a fleet: ``python -m benchmark.processes.fleet_ear WAY ROUTER``.

WAY is one of ``WAYS``. The main thread waits for commands, and costs nothing; Zenoh's
threads do the listening.
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

# Threads that look up as soon as there is something new; each waits most of the time.
_LOOKING = 8


class OurEar:
    """``FleetListener``, all robots in one buffer."""

    def __init__(self, router: str) -> None:
        self._listener = FleetListener(router)
        self.close = self._listener.close

    def taken(self) -> int:
        """Return how many transforms were taken, static ones too."""
        return self._listener.buffer.statistics().accepted

    def lags(self, robots: int, leaf: str, seconds: float) -> list[float]:
        """
        Return how long after its publication a lookup had each of some messages, milliseconds.

        :param leaf: the last frame of each robot that moves.
        """
        end = time.monotonic() + seconds
        with ThreadPoolExecutor(_LOOKING) as pool:
            found = pool.map(lambda first: self._look(
                [f'robot{number}/{leaf}' for number in range(first, robots, _LOOKING)], end),
                range(min(robots, _LOOKING)))
        return list(itertools.chain(*found))

    def _look(self, frames: list[str], end: float) -> list[float]:
        """Look the newest of one frame after the other up, when it comes."""
        buffer, lags = self._listener.buffer, []
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


class PlainEar:
    """A plain subscription whose callback counts, and is otherwise empty."""

    def __init__(self, router: str) -> None:
        self._count = 0
        self._session: Any = open_session(configuration(router), 10.0)
        self.close = self._session.close
        self._subscriber = self._session.declare_subscriber('*/tf', self._receive)

    def _receive(self, _: zenoh.Sample) -> None:
        self._count += 1

    def taken(self) -> int:
        """Return how many messages came."""
        return self._count


class EarByHand(PlainEar):
    """The messages deserialized, and their transforms set one by one, as people do it."""

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


WAYS = {OURS: OurEar, PLAIN_ZENOH: PlainEar, BY_HAND: EarByHand}


def main(way: str, router: str) -> None:
    """Listen in a way, and answer what is asked."""
    with closing(WAYS[way](router)) as ear:
        serve({'cpu_s': time.process_time, 'taken': ear.taken,
               **({'lags': ear.lags} if isinstance(ear, OurEar) else {})})


if __name__ == '__main__':
    main(*sys.argv[1:])
