# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Decodes the messages of an inbox, and inserts them into buffers.

An inbox has a queue for each robot; all share one decoding thread fairly. The robot that has used
the least time of this thread is served next (start-time fair queuing: P. Goyal, H. M. Vin,
H. Cheng, IEEE/ACM Transactions on Networking 5(5), 1997). So a robot with many or costly messages
delays only itself. This file does not depend on Zenoh.
"""

from collections import deque, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
import heapq
import threading
import time
from typing import NamedTuple

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import WireReader

from .connection import FleetLogs
from .roster import Roster
from .trust import without_others

_DEFAULT_WAITING = 64_000_000
"""The most bytes that wait, of all robots together."""
# About the memory of a message in addition to its bytes.
_OVERHEAD = 500


class FleetMessage(NamedTuple):
    """
    A message of a robot that is not decoded yet.

    :ivar data: a serialized TFMessage, or any other bytes.
    :ivar received: the time of arrival, nanoseconds; 0: it comes from a cache, so the time of
        arrival means nothing.
    """

    key: str
    static: bool
    data: bytes
    received: int


@dataclass
class _Line:
    """
    The queue of one robot.

    :ivar served: the virtual time at which its next turn begins, seconds.
    :ivar has_turn: whether it is scheduled, or is being served.
    :ivar waiting: each message, and the bytes of memory that it takes.
    """

    served: float = 0.0
    has_turn: bool = False
    size: int = 0
    waiting: deque[tuple[FleetMessage, int]] = field(default_factory=deque)

    def pop_oldest(self) -> tuple[FleetMessage, int]:
        """Remove the oldest message; return it and its size."""
        message, size = self.waiting.popleft()
        self.size -= size
        return message, size


class Inbox:
    """A queue for each robot; any thread may put messages, and one thread takes them."""

    def __init__(self, most_of_one: int, most_of_all: int = _DEFAULT_WAITING) -> None:
        """
        Begin empty.

        :param most_of_one: the most bytes of one robot; beyond it, its oldest messages are
            dropped.
        :param most_of_all: the most bytes of all robots; beyond it, the oldest messages of the
            robot with the most bytes are dropped.
        """
        self._most_of_one, self._most_of_all = most_of_one, most_of_all
        self._changed = threading.Condition()
        self._lines: dict[str, _Line] = {}
        # The schedule: (virtual time, robot) of each robot whose queue is not empty.
        self._turns: list[tuple[float, str]] = []
        self._now = 0.0
        self._size = 0
        self._closed = False

    def put(self, robot: str, message: FleetMessage, size: int) -> list[str]:
        """Add a message; return the robots that lost one for it, an entry for each message."""
        with self._changed:
            line = self._lines.setdefault(robot, _Line())
            dropped = []
            while line.waiting and line.size + size + _OVERHEAD > self._most_of_one:
                self._size -= line.pop_oldest()[1]
                dropped.append(robot)
            if not line.has_turn:
                self._begin_turn(robot, line)
            line.waiting.append((message, size + _OVERHEAD))
            line.size += size + _OVERHEAD
            self._size += size + _OVERHEAD
            while self._size > self._most_of_all:
                heaviest = max(self._lines, key=lambda name: self._lines[name].size)
                self._size -= self._lines[heaviest].pop_oldest()[1]
                dropped.append(heaviest)
            self._changed.notify()
            return dropped

    def pop(self) -> tuple[str, FleetMessage] | None:
        """Return the next robot and its message, when there is one; None: it is closed."""
        with self._changed:
            while not self._closed:
                while self._turns:
                    self._now, robot = heapq.heappop(self._turns)
                    line = self._lines[robot]
                    if line.waiting:
                        message, size = line.pop_oldest()
                        self._size -= size
                        return robot, message
                    line.has_turn = False
                self._changed.wait()
            return None

    def charge(self, robot: str, seconds: float) -> None:
        """Charge a robot for the processor time of the message that was taken last."""
        with self._changed:
            line = self._lines[robot]
            line.served += seconds
            line.has_turn = False
            if line.waiting:
                self._begin_turn(robot, line)

    def close(self) -> None:
        """Close the inbox: messages that still wait are never taken."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _begin_turn(self, robot: str, line: _Line) -> None:
        # A robot saves up no time while its queue is empty.
        line.served = max(line.served, self._now)
        line.has_turn = True
        heapq.heappush(self._turns, (line.served, robot))


# --- decoding

# Bytes that the layouts of one robot's moving messages may take, and those of its static ones; and
# those of all robots together.
LAYOUTS_OF_ONE, LAYOUTS_OF_ALL = 2_000_000, 64_000_000
_NOTHING = Batch((), (), ())


class RobotPlace(NamedTuple):
    """
    The destination of the transforms of one robot.

    :ivar rename: the names of its frames there.
    :ivar shared: frames that it must not attach elsewhere.
    """

    buffer: BufferCore
    rename: Rename
    shared: frozenset[str]


class TransformDecoder:
    """Decodes messages of all robots, in one thread."""

    def __init__(self, place_of: Callable[[str], RobotPlace], roster: Roster, logs: FleetLogs
                 ) -> None:
        """
        Begin without robots.

        :param place_of: returns the destination of the transforms of a robot.
        """
        self._place_of = place_of
        self._roster = roster
        self._logs = logs
        # In the order of their last use.
        self._readers: OrderedDict[tuple[str, bool], WireReader] = OrderedDict()
        self._remembered = 0

    def decode_all(self, inbox: Inbox) -> None:
        """Decode messages until the inbox is closed."""
        while (taken := inbox.pop()) is not None:
            begin = time.thread_time()
            try:
                self.decode(*taken)
            except Exception:  # noqa: B902 - the next may be valid
                self._logs.failures.report('tf_tree_py.fleet, in a message,', taken[0])
            cost = time.thread_time() - begin
            self._roster.spend(taken[0], cost)
            inbox.charge(taken[0], cost)

    def decode(self, robot: str, message: FleetMessage) -> None:
        """Decode a message of a robot, and insert its transforms."""
        place = self._place_of(robot)
        batch = self._read(robot, place.rename, message)
        if isinstance(batch, Incident):
            place.buffer.intake.refuse(batch)
            self._logs.incidents.report([batch])
            self._roster.record(robot, 0, 1, None, not message.received)
            return
        incidents, refused = self._insert(robot, place, batch, message)
        if incidents:
            self._logs.incidents.report(incidents)
        count = len(batch.stamps) + len(batch.impossible)
        self._roster.record(robot, max(0, count - refused), refused,
                            None if message.static else max(batch.stamps, default=None),
                            not message.received)

    def _read(self, robot: str, rename: Rename, message: FleetMessage) -> Batch | Incident:
        """Return the transforms of a message; the layouts of recent senders are remembered."""
        key = robot, message.static
        reader = self._readers.get(key)
        if reader is None:
            reader = self._readers[key] = WireReader(
                rename, most=LAYOUTS_OF_ONE, static=message.static)
        self._readers.move_to_end(key)
        before = reader.remembered
        batch = reader.read_or_refuse(message.data, robot)
        self._remembered += reader.remembered - before
        while self._remembered > LAYOUTS_OF_ALL:
            self._remembered -= self._readers.popitem(last=False)[1].remembered
        return batch

    def _insert(self, robot: str, place: RobotPlace, batch: Batch, message: FleetMessage
                ) -> tuple[list[Incident], int]:
        """Insert a message; return its incidents, and the number of refused transforms."""
        buffer = place.buffer
        if buffer.observers.of_messages:
            buffer.observers.notify_received(ReceivedMessage(
                batch, message.received, message.key, message.static, robot))
        own, incidents = without_others(batch, place.shared, robot)
        fitting = self._roster.within_frames(robot, own, place.shared)
        if len(fitting.edges) < len(own.edges):
            incidents.append(_too_many(robot, own, fitting))
        for incident in incidents:
            buffer.intake.refuse(incident)
        more = buffer.insert_batch(
            fitting, robot, message.static,
            announced=True) if fitting.edges or fitting.impossible else []
        return incidents + more, (len(batch.edges) - len(fitting.edges)
                                  + sum(incident.refused for incident in more))


def _too_many(robot: str, batch: Batch, fitting: Batch) -> Incident:
    """Return one incident for all edges of a message that exceed the quota."""
    taken = set(fitting.edges)
    (parent, child), stamp = next(
        (edge, stamp) for edge, stamp in zip(batch.edges, batch.stamps, strict=True)
        if edge not in taken)
    return Incident(
        Kind.TOO_MANY_FRAMES, parent, child, stamp, robot,
        f'the robot has exceeded its quota of frame names (RobotQuota.frames): '
        f'{len(batch.edges) - len(fitting.edges)} transforms of this message are left out')
