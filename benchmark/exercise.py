# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The lookups that every contestant performs: the same task in the same steps.

Uses the standard library only, because a contestant in another Python also imports this module.
"""

from collections.abc import Iterator, Sequence
import itertools
import statistics
import time
from typing import Any, NamedTuple, Protocol

from . import motion
from .motion import PERIOD, Pose, Robot, START
from .timing import clock, cost_of_clock, cpu_clock

_SAMPLES_A_SECOND = 1_000_000_000 // PERIOD

# The golden ratio: its successive multiples, modulo 1, are evenly distributed and never repeat.
_GOLDEN = 0.6180339887498949

# Where stamps lie, in halves of the history before the newest: the nearest one, and how wide.
_MIDDLE, _ANYWHERE = (0.9, 0.2), (0.1, 1.8)

# The period with which tf2 polls for missing data: tf2_ros_py, Buffer.can_transform.
_TF2_POLLS_EVERY_S = 0.02


class Unable(Exception):
    """A contestant cannot do a task; the text gives the reason."""


class Peer(Protocol):
    """The operations of a contestant."""

    def reset(self, robot: Robot, history_s: float) -> None:
        """
        Start again, with an empty buffer for a robot.

        :raises Unable: the contestant does not support this robot.
        """

    def message(self, edge: motion.Edge, stamp: int, pose: Pose) -> Any:
        """Return one transform in the form that ``insert`` accepts."""

    def insert(self, message: Any) -> object:
        """Insert a moving transform."""

    def insert_static(self, message: Any) -> object:
        """Insert a static transform."""

    def time(self, stamp: int) -> Any:
        """Return a stamp in the form that ``lookup`` accepts; 0 is the latest."""

    def lookup(self, target: str, source: str, stamp: Any) -> Any:
        """Return the result of a lookup in the form that users receive."""

    def lookup_tree(self, target: str, stamp: Any) -> dict[str, Any]:
        """Return all frames relative to one, by name."""

    def pose(self, answer: Any) -> Sequence[float]:
        """Return x y z and quaternion x y z w of a result of ``lookup`` or ``lookup_tree``."""


class Task(NamedTuple):
    """
    Lookups of one kind.

    :ivar robot: see ``motion.robot``.
    :ivar history_s: the length of the history in the buffer.
    :ivar latest: look up the latest; otherwise stamps near the middle of the history.
    :ivar count: lookups per round.
    :ivar whole_tree: look up all frames relative to the target each time.
    :ivar age_s: look up stamps that are this much older than the newest samples, within half a
        period, instead of those near the middle; None for those.
    :ivar whole_message: insert the next sample of all edges between two lookups, as a robot does
        that publishes them in one message; otherwise that of one edge.
    :ivar anywhere: spread the stamps over the whole history, instead of near its middle.
    """

    robot: str
    history_s: float
    latest: bool
    count: int  # type: ignore[assignment] # hides tuple.count, which nothing calls
    whole_tree: bool = False
    age_s: float | None = None
    whole_message: bool = False
    anywhere: bool = False


class Exercise:
    """
    One contestant performing one task; each round continues from the end of the last one.

    Between every two lookups, the next sample of an edge of the path is inserted, each edge in
    turn, or those of all edges. The window slides, so no earlier result can be reused.
    """

    def __init__(self, peer: Peer, task: Task) -> None:
        """Fill the peer's buffer."""
        self.peer = peer
        self.task = task
        self.robot = motion.robot(task.robot)
        self._samples = round(task.history_s * _SAMPLES_A_SECOND)
        peer.reset(self.robot, task.history_s)
        for edge in self.robot.edges:
            if edge.static:
                peer.insert_static(self._message(edge, 0))
                continue
            for sample in range(self._samples):
                peer.insert(self._message(edge, sample))
        self._steps = self._steps_for_ever()
        self._ask = self._ask_tree if task.whole_tree else peer.lookup

    def answers(self) -> list[list[float]]:
        """Return some results, for comparison: at samples, between them, and the latest."""
        # The latest is worth comparing when one edge is ahead. The others skip this sample.
        self.peer.insert(self._message(self.robot.moving[0], self._samples))
        self._samples += 1
        middle = START + self._samples // 2 * PERIOD
        stamps = [middle, *(middle + number * PERIOD // 7 for number in range(-10, 10)), 0]
        answers = [self.answer(stamp) for stamp in stamps]
        if self.task.whole_tree:
            tree = self.peer.lookup_tree(self.robot.target, self.peer.time(middle))
            answers += [self._numbers(tree[edge.child]) for edge in self.robot.edges]
        return answers

    def answer(self, stamp: int) -> list[float]:
        """Return the pose of one lookup."""
        return self._numbers(self.peer.lookup(
            self.robot.target, self.robot.source, self.peer.time(stamp)))

    def _numbers(self, answer: Any) -> list[float]:
        return list(map(float, self.peer.pose(answer)))

    def take_turn(self) -> float:
        """Return the seconds per lookup, the median of the turn."""
        steps = list(itertools.islice(self._steps, self.task.count))
        target, source = self.robot.target, self.robot.source
        insert, ask = self.peer.insert, self._ask
        spent = []
        for messages, stamp in steps:
            for message in messages:
                insert(message)
            begin = clock()
            ask(target, source, stamp)
            spent.append(clock() - begin)
        return statistics.median(spent) - cost_of_clock()

    def change(self, *, latest: bool, count: int) -> None:
        """Continue on the same buffer with other stamps or another number of lookups."""
        self.task = self.task._replace(latest=latest, count=count)

    def loop(self, stamps: Sequence[int]) -> float:
        """Return the seconds per lookup in a loop over stamps."""
        target, source = self.robot.target, self.robot.source
        lookup = self.peer.lookup
        times = [self.peer.time(stamp) for stamp in stamps]
        begin = cpu_clock()
        for stamp in times:
            lookup(target, source, stamp)
        return (cpu_clock() - begin) / len(times)

    def insertions(self, batches: int) -> float:
        """Return the seconds per insertion, measured over this many messages of every edge."""
        robot, insert = self.robot, self.peer.insert
        first, self._samples = self._samples, self._samples + batches
        messages = [self._message(edge, sample)
                    for sample in range(first, first + batches) for edge in robot.edges]
        begin = cpu_clock()
        for message in messages:
            insert(message)
        return (cpu_clock() - begin) / len(messages)

    def _ask_tree(self, target: str, _: str, stamp: Any) -> object:
        return self.peer.lookup_tree(target, stamp)

    def _steps_for_ever(self) -> Iterator[tuple[list[Any], Any]]:
        """Yield, without end, messages to insert and the stamp to look up after them."""
        moving = self.robot.moving
        if self.task.whole_tree:
            moving = [edge for edge in self.robot.edges if not edge.static]
        groups = [moving] if self.task.whole_message else [[edge] for edge in moving]
        for step in itertools.count():
            number, turn = divmod(step, len(groups))
            messages = [self._message(edge, self._samples + number) for edge in groups[turn]]
            # All edges have data until this stamp.
            newest = START + (self._samples + number - 1) * PERIOD
            yield messages, self.peer.time(self._stamp(newest, step * _GOLDEN % 1.0))

    def _stamp(self, newest: int, part: float) -> int:
        """Return the stamp to look up; the part, from 0 to 1, varies stamps of one kind."""
        if self.task.latest:
            return 0
        if self.task.age_s is not None:
            return int(newest - self.task.age_s * 1e9 + PERIOD * (part - 0.5))
        # In the span in which all edges have data.
        first, width = _ANYWHERE if self.task.anywhere else _MIDDLE
        return int(newest - self.task.history_s * 1e9 / 2.0 * (first + width * part))

    def _message(self, edge: motion.Edge, sample: int) -> Any:
        stamp = edge.stamp_of(sample)
        return self.peer.message(edge, stamp, motion.pose_at(edge, stamp))


def poll_as_tf2_does(peer: Any, target: str, source: str, stamp: Any, timeout_s: float) -> Any:
    """Return a lookup that may wait, implemented like tf2's Python code."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end and not peer.can(target, source, stamp):
        time.sleep(_TF2_POLLS_EVERY_S)
    return peer.lookup(target, source, stamp)
