# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Insertion of whole messages, from objects and from bytes, and of single transforms.

And of many samples of one edge, from arrays.
"""

from collections.abc import Callable, Collection, Iterator
import functools
import itertools
from typing import Any

from geometry_msgs.msg import TransformStamped
import numpy as np
from rclpy.serialization import deserialize_message
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, BufferCore, UNLIMITED
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY
from tf_tree_py.core.messages.wire import WireReader
from tf_tree_py.frame_names import rename
from tf_tree_py.ros.messages.convert import as_sample

from .. import motion, wire
from ..effort import Effort
from ..exercise import Task
from ..peers.finding import Contestants
from ..peers.messages import transform_stamped
from ..peers.ours import OurBuffer
from ..rows import CORE, DEBIAN, EMPTY, JAZZY, OURS, Row, RUST, scaled
from ..timing import cpu_clock, interleave, time_each

# By the number of transforms in a message: the targets per transform, as multiples of
# constructing an empty one, from a message and from wire bytes.
_TARGETS: dict[int, tuple[float | None, float | None]] = {
    1: (None, None), 5: (None, None), 38: (0.4, 0.17)}
_HISTORY_S = 1.0


def inserting(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure a transform's insertion, compared with the construction of an empty one."""
    for transforms, (of_message, of_wire) in _TARGETS.items():
        robot = motion.chain(transforms)
        _check_wire(robot)
        messages = max(50, 4 * effort.lookups // transforms)
        from_message, from_wire = f'{OURS}, messages', f'{OURS}, wire bytes'
        two_wanted = f'{OURS}, two wanted'
        turns: dict[str, Callable[[], float]] = {
            from_message: _Turn(robot, messages, _message_at, _insert_message),
            from_wire: _Turn(robot, messages, wire.message_at, _bytes_inserter()),
            two_wanted: _Turn(robot, messages, wire.message_at, _bytes_inserter(
                {name for edge in robot.edges[:2] for name in (edge.parent, edge.child)})),
            EMPTY: lambda: time_each(TransformStamped, effort.lookups),
        }
        exercises = contestants.exercises(
            Task(f'chain{transforms}', _HISTORY_S, False, 1), (OURS, DEBIAN, JAZZY, RUST))
        for name, exercise in exercises.items():
            turns[f'{name}, one by one'] = functools.partial(
                exercise.insertions, batches=messages)
        row = Row('insert', f'{transforms} in a message', 'us a transform',
                  scaled(interleave(turns, effort.rounds), 1e6))
        row.compare(from_message, EMPTY, of_message, name=f'{row.name}, from a message')
        row.compare(from_wire, EMPTY, of_wire, name=f'{row.name}, from wire bytes')
        row.compare(two_wanted, from_wire, name=f'{row.name}, two of them wanted')
        row.compare(f'{OURS}, one by one', f'{DEBIAN}, one by one',
                    name=f'{transforms} one by one, set_transform', unit=f'x {DEBIAN}')
        yield row
    yield _arrays(effort)


def _arrays(effort: Effort) -> Row:
    """Measure the insertion of one edge's samples as arrays, compared with a loop and a copy."""
    edge, = motion.chain(1).edges
    count = 25 * effort.lookups
    stamps = np.array([edge.stamp_of(sample) for sample in range(count)])
    poses = np.array([motion.pose_at(edge, stamp) for stamp in stamps.tolist()])
    samples = list(zip(stamps.tolist(), poses.tolist(), strict=True))

    def insert_track() -> None:
        BufferCore(UNLIMITED).insert_track(edge.parent, edge.child, stamps, poses)

    def loop() -> None:
        insert = BufferCore(UNLIMITED).insert
        for stamp, pose in samples:
            insert(edge.parent, edge.child, stamp, pose)

    def copy() -> None:
        stamps.copy(), poses.copy()

    whole, single, memory = f'{CORE}, insert_track', f'{CORE}, a loop of insert', 'a copy of both'
    turns = {name: functools.partial(time_each, call, 1)
             for name, call in ((whole, insert_track), (single, loop), (memory, copy))}
    row = Row('insert', f'arrays of {count:,} samples', 'us a transform',
              scaled(interleave(turns, effort.rounds), 1e6 / count))
    row.compare(whole, single, name='insert_track')
    row.compare(whole, memory, name='insert_track')
    return row


class _Turn:
    """Successive messages, each with the next sample of every edge."""

    def __init__(self, robot: motion.Robot, messages: int,
                 make: Callable[[list[motion.Edge], int], Any],
                 insert: Callable[[Buffer, Any], object]) -> None:
        """
        Fill a buffer.

        :param make: returns a message with the sample of a given number of each of these edges.
        :param insert: inserts it into a buffer.
        """
        self._edges = robot.edges
        self._messages = messages
        self._make = make
        self._insert_one = insert
        peer = OurBuffer()
        peer.reset(robot, _HISTORY_S)
        self._buffer = peer.buffer
        self._samples = itertools.count()
        self._insert(200)

    def __call__(self) -> float:
        """Return the seconds per transform."""
        return self._insert(self._messages)

    def _insert(self, count: int) -> float:
        messages = [self._make(self._edges, sample)
                    for sample in itertools.islice(self._samples, count)]
        buffer, insert = self._buffer, self._insert_one
        begin = cpu_clock()
        for message in messages:
            insert(buffer, message)
        return (cpu_clock() - begin) / (count * len(self._edges))


def _message_at(edges: list[motion.Edge], sample: int) -> TFMessage:
    return TFMessage(transforms=[
        transform_stamped(edge, edge.stamp_of(sample), motion.pose_at(edge, edge.stamp_of(sample)))
        for edge in edges])


def _insert_message(buffer: Buffer, message: TFMessage) -> None:
    samples = [as_sample(transform) for transform in message.transforms]
    buffer.feeds.note(buffer.intake.insert(samples, DEFAULT_AUTHORITY, False))


def _bytes_inserter(frame_filter: Collection[str] | None = None
                    ) -> Callable[[Buffer, bytes], None]:
    """Return the function with which a listener with this filter processes received bytes."""
    read = WireReader(rename(frame_filter=frame_filter)).read

    def insert(buffer: Buffer, data: bytes) -> None:
        buffer.feeds.note(buffer.insert_batch(read(data)))

    return insert


def _check_wire(robot: motion.Robot) -> None:
    """Check that ROS deserializes our bytes to the intended messages."""
    if deserialize_message(wire.message_at(robot.edges, 0), TFMessage) != _message_at(
            robot.edges, 0):
        raise AssertionError('wire.message_at does not write what ROS does')
