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
The lookups that every contestant has to do: one task, the same steps.

Standard library only, for a contestant in another Python imports this too.
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

# Successive multiples of it fall evenly on an interval and never repeat.
_GOLDEN = 0.6180339887498949

# tf2 polls so often for what is not there yet: tf2_ros_py, Buffer.can_transform.
_TF2_POLLS_EVERY_S = 0.02


class Unable(Exception):
    """A contestant cannot do a task, and says why."""


class Peer(Protocol):
    """What a contestant has to be able to do."""

    def reset(self, robot: Robot, history_s: float) -> None:
        """
        Begin anew, with an empty buffer for a robot.

        :raises Unable: this robot is not for this contestant.
        """

    def message(self, edge: motion.Edge, stamp: int, pose: Pose) -> Any:
        """Return one transform in the form that ``insert`` takes."""

    def insert(self, message: Any) -> object:
        """Take a transform that moves."""

    def insert_static(self, message: Any) -> object:
        """Take one that does not."""

    def time(self, stamp: int) -> Any:
        """Return a stamp in the form that ``lookup`` takes; 0 is the latest."""

    def lookup(self, target: str, source: str, stamp: Any) -> Any:
        """Return what a user gets."""

    def lookup_tree(self, target: str, stamp: Any) -> dict[str, Any]:
        """Return all frames relative to one, by name."""

    def pose(self, answer: Any) -> Sequence[float]:
        """Return x y z and quaternion x y z w of what ``lookup`` returned, or its tree holds."""


class Task(NamedTuple):
    """
    Lookups of one kind.

    :ivar robot: see ``motion.robot``.
    :ivar history_s: how much history the buffer holds.
    :ivar latest: ask for the latest; else for stamps about the middle of the history.
    :ivar count: lookups a round.
    :ivar whole_tree: each time ask for all frames relative to the target.
    """

    robot: str
    history_s: float
    latest: bool
    count: int
    whole_tree: bool = False


class Exercise:
    """
    One contestant at one task, which goes on where its last round ended.

    Between every two lookups an insertion: the next sample of an edge on the way,
    in turn. So the window slides, and no answer is the one before.
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
        """Return some answers, for comparison: at samples, between them, and the latest."""
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
        """Return one answer."""
        return self._numbers(self.peer.lookup(
            self.robot.target, self.robot.source, self.peer.time(stamp)))

    def _numbers(self, answer: Any) -> list[float]:
        return list(map(float, self.peer.pose(answer)))

    def take_turn(self) -> float:
        """Return the seconds that a lookup took, the median of the turn."""
        steps = list(itertools.islice(self._steps, self.task.count))
        target, source = self.robot.target, self.robot.source
        insert, ask = self.peer.insert, self._ask
        spent = []
        for message, stamp in steps:
            insert(message)
            begin = clock()
            ask(target, source, stamp)
            spent.append(clock() - begin)
        return statistics.median(spent) - cost_of_clock()

    def loop(self, stamps: Sequence[int]) -> float:
        """Return the seconds that a lookup takes in a loop over stamps."""
        target, source = self.robot.target, self.robot.source
        lookup = self.peer.lookup
        times = [self.peer.time(stamp) for stamp in stamps]
        begin = cpu_clock()
        for stamp in times:
            lookup(target, source, stamp)
        return (cpu_clock() - begin) / len(times)

    def insertions(self, batches: int) -> float:
        """Return the seconds that an insertion takes: as many messages of every edge."""
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

    def _steps_for_ever(self) -> Iterator[tuple[Any, Any]]:
        """Yield a message to insert and the stamp to ask for then."""
        moving = self.robot.moving
        if self.task.whole_tree:
            moving = [edge for edge in self.robot.edges if not edge.static]
        half = self.task.history_s * 1e9 / 2.0
        for step in itertools.count():
            number, turn = divmod(step, len(moving))
            message = self._message(moving[turn], self._samples + number)
            if self.task.latest:
                stamp = 0
            else:
                newest = START + (self._samples + number - 1) * PERIOD
                # About the middle of what all edges have.
                stamp = int(newest - half * (0.9 + 0.2 * (step * _GOLDEN % 1.0)))
            yield message, self.peer.time(stamp)

    def _message(self, edge: motion.Edge, sample: int) -> Any:
        stamp = edge.stamp_of(sample)
        return self.peer.message(edge, stamp, motion.pose_at(edge, stamp))


def poll_as_tf2_does(peer: Any, target: str, source: str, stamp: Any, timeout_s: float) -> Any:
    """Return a lookup that may have to wait, the way that tf2's Python writes it."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end and not peer.can(target, source, stamp):
        time.sleep(_TF2_POLLS_EVERY_S)
    return peer.lookup(target, source, stamp)
