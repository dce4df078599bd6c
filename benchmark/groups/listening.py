# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The CPU cost of listening to /tf, in a process that does nothing else."""

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

# Separate programs, which do not report how many messages they received.
_TOOLS = (TF_DOCTOR, TF_MONITOR)
_OF_PLAIN = 1 / 6
# Of a bare listener.
_GOALS = {DOCTOR: 1.25, TF_DOCTOR: 2.0, TF_MONITOR: 2.0}


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
    """Measure the cost of a doctor that always observes, and of the tools that have one."""
    row = _row('doctor', [OURS, DOCTOR, *_TOOLS], *STREAMS[-1], effort)
    for way, goal in _GOALS.items():
        row.compare(way, OURS, goal, name=f'{row.name}: {way}')
    yield row


def _row(group: str, ways: Sequence[str], transforms: int, rate_hz: int, effort: Effort) -> Row:
    """Run all listeners on one stream, several times."""
    with ExitStack() as processes:
        publisher = processes.enter_context(start('publisher'))
        subscribers = {way: processes.enter_context(
            start('looker' if way in _TOOLS else 'subscriber', way)) for way in ways}
        stream = Stream(publisher, subscribers, transforms, rate_hz)
        stream.await_all()
        rounds = [stream.play(effort.stream_s) for _ in range(effort.streams)]
    row = Row(group, f'{transforms} x {rate_hz} Hz', 'us a message',
              {way: [one.cpu_us[way] for one in rounds] for way in ways})
    # The sum over all rounds, because most rounds lose nothing.
    row.values |= {f'{way}, lost of all': [sum(one.lost[way] for one in rounds)]
                   for way in ways if way not in (TF2_ROS, *_TOOLS)}
    return row


def start(process: str, *arguments: str) -> Worker:
    """Start one of ``processes`` in this Python."""
    return Worker([sys.executable, '-m', f'benchmark.processes.{process}', *arguments])


class Round:
    """
    The cost of one stream.

    :ivar cpu_us: CPU time per message, by listener.
    :ivar lost: the number of messages that did not arrive, by listener.
    """

    def __init__(self) -> None:
        self.cpu_us: dict[str, float] = {}
        self.lost: dict[str, float] = {}


class Stream:
    """One publisher of messages with several transforms or joints, and all its subscribers."""

    def __init__(self, publisher: Worker, subscribers: dict[str, Worker], transforms: int,
                 rate_hz: int) -> None:
        self._publisher = publisher
        self._subscribers = subscribers
        self._transforms = transforms
        self._rate_hz = rate_hz
        self._sent = 0

    def change_rate(self, rate_hz: int) -> None:
        """Continue with another number of messages a second."""
        self._rate_hz = rate_hz

    def await_all(self) -> None:
        """Return when every subscriber receives messages and all are processed."""
        receiving: set[str] = set()
        while len(receiving) < len(self._subscribers):
            self._send(10)
            receiving = {way for way, subscriber in self._subscribers.items()
                         if self._usage(subscriber)['received'] != 0}
            time.sleep(0.1)
        self._send(self._rate_hz)
        self._settle()

    def play(self, seconds: float) -> Round:
        """Send for a time; return the cost."""
        count = round(seconds * self._rate_hz)
        before = {way: self._usage(subscriber) for way, subscriber in self._subscribers.items()}
        self._send(count)
        self._settle()
        result = Round()
        for way, subscriber in self._subscribers.items():
            after = self._usage(subscriber)
            result.cpu_us[way] = (after['cpu_s'] - before[way]['cpu_s']) / count * 1e6
            if after['received'] is not None:
                result.lost[way] = count - (after['received'] - before[way]['received'])
        return result

    def _send(self, count: int) -> None:
        self._publisher.call('send', first=self._sent, count=count,
                             transforms=self._transforms, rate_hz=self._rate_hz)
        self._sent += count

    def _usage(self, subscriber: Worker) -> dict[str, float]:
        return subscriber.call('usage', transforms=self._transforms)

    def _settle(self) -> None:
        """Return when the last message has been processed."""
        received = None
        while received != (received := [self._usage(subscriber)['received']
                                        for subscriber in self._subscribers.values()]):
            time.sleep(0.2)
