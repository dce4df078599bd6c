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

"""What listening to /tf costs: CPU of a process that does nothing else."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
import sys
import time

from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import DOCTOR, OURS, PLAIN, Row, TF2_ROS, TF_DOCTOR, TF_MONITOR
from ..worker import Worker

# Transforms in a message, and messages a second.
STREAMS = [(1, 1000), (5, 500), (38, 100), (38, 500)]

# Programs of their own, which do not tell what they received.
_TOOLS = (TF_DOCTOR, TF_MONITOR)
_OF_PLAIN = 1 / 6
_OF_BARE = 2.0


def listening(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure all listeners on the same streams, at the same time."""
    ways = [OURS, PLAIN, *([TF2_ROS] if contestants.tf2_ros else [])]
    for transforms, rate_hz in STREAMS:
        row = _row('listener', ways, transforms, rate_hz, effort)
        row.compare(OURS, PLAIN, _OF_PLAIN)
        row.compare(OURS, TF2_ROS)
        row.judge(f'{OURS}, lost of all', 0, name=f'{row.name}: messages lost', unit='')
        yield row


def watching(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure what a doctor costs that watches all the time, and the tools that have one."""
    row = _row('doctor', [OURS, DOCTOR, *_TOOLS], *STREAMS[-1], effort)
    for way in (DOCTOR, *_TOOLS):
        row.compare(way, OURS, _OF_BARE, name=f'{row.name}: {way}')
    yield row


def _row(group: str, ways: Sequence[str], transforms: int, rate_hz: int, effort: Effort) -> Row:
    """Let all listen to one stream, several times."""
    with ExitStack() as processes:
        publisher = processes.enter_context(start('publisher'))
        ears = {way: processes.enter_context(
            start('looker' if way in _TOOLS else 'subscriber', way)) for way in ways}
        stream = Stream(publisher, ears, transforms, rate_hz)
        stream.await_all()
        rounds = [stream.play(effort.stream_s) for _ in range(effort.streams)]
    row = Row(group, f'{transforms} x {rate_hz} Hz', 'us a message',
              {way: [one.cpu_us[way] for one in rounds] for way in ways})
    # However often nothing was lost: it is the sum that counts.
    row.values |= {f'{way}, lost of all': [sum(one.lost[way] for one in rounds)]
                   for way in ways if way not in (TF2_ROS, *_TOOLS)}
    return row


def start(process: str, *arguments: str) -> Worker:
    """Start one of ``processes`` in this Python."""
    return Worker([sys.executable, '-m', f'benchmark.processes.{process}', *arguments])


class Round:
    """
    What one stream cost.

    :ivar cpu_us: of each way to listen, a message.
    :ivar lost: how many messages did not arrive.
    """

    def __init__(self) -> None:
        self.cpu_us: dict[str, float] = {}
        self.lost: dict[str, float] = {}


class Stream:
    """One publisher of messages about some things (transforms, joints), and all who listen."""

    def __init__(self, publisher: Worker, ears: dict[str, Worker], transforms: int,
                 rate_hz: int) -> None:
        self._publisher = publisher
        self._ears = ears
        self._transforms = transforms
        self._rate_hz = rate_hz
        self._sent = 0

    def await_all(self) -> None:
        """Return when everybody hears the publisher, and has settled."""
        heard: set[str] = set()
        while len(heard) < len(self._ears):
            self._send(10)
            heard = {way for way, ear in self._ears.items()
                     if self._usage(ear)['received'] != 0}
            time.sleep(0.1)
        self._send(self._rate_hz)
        self._settle()

    def play(self, seconds: float) -> Round:
        """Send for a while; return what it cost."""
        count = round(seconds * self._rate_hz)
        before = {way: self._usage(ear) for way, ear in self._ears.items()}
        self._send(count)
        self._settle()
        result = Round()
        for way, ear in self._ears.items():
            after = self._usage(ear)
            result.cpu_us[way] = (after['cpu_s'] - before[way]['cpu_s']) / count * 1e6
            if after['received'] is not None:
                result.lost[way] = count - (after['received'] - before[way]['received'])
        return result

    def _send(self, count: int) -> None:
        self._publisher.call('send', first=self._sent, count=count,
                             transforms=self._transforms, rate_hz=self._rate_hz)
        self._sent += count

    def _usage(self, ear: Worker) -> dict[str, float]:
        return ear.call('usage', transforms=self._transforms)

    def _settle(self) -> None:
        """Return when the last message has been worked off."""
        received = None
        while received != (received := [self._usage(ear)['received']
                                        for ear in self._ears.values()]):
            time.sleep(0.2)
