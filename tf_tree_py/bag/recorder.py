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

"""What a buffer holds becomes a bag, which players and viewers of ROS 2 open."""

from collections.abc import Iterable, Iterator, Mapping
import heapq
import itertools
import os
from pathlib import Path
import shutil
from tempfile import mkdtemp
from typing import NamedTuple

from tf_tree_py.core.arrivals.received import Received
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import WireWriter, write as as_bytes
from tf_tree_py.core.edges.packed import POSE_BYTES, unpack_pose
from tf_tree_py.core.edges.protocol import moves, MovingHistory
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.tree import Tree

from .errors import BagError, needs_extra

_TYPE = 'tf2_msgs/msg/TFMessage'
_SUFFIX = '.mcap'
# Transforms of one stamp that go into one message; more go into several.
_MOST = 1000
NO_REMARKS: Mapping[str, str] = {}


class Message(NamedTuple):
    """One message to record: when it is to be played, nanoseconds, and its bytes."""

    time: int
    static: bool
    data: bytes


def record(tree: Tree, path: str | os.PathLike[str]) -> None:
    """
    Write a tree, that nobody changes meanwhile, as a bag of MCAP.

    ``/tf_static`` first, transient local, so that a player serves who comes late; then
    ``/tf`` in order of the stamps, which are also the times at which it is played. Of a
    spline it has ten poses for each piece; a bag has no place for covariances, nor for what
    a gyroscope says between two poses. Parameters and errors are those of ``write``.
    """
    write(messages_of(tree), path)


def write(messages: Iterable[Message], path: str | os.PathLike[str],
          remarks: Mapping[str, str] = NO_REMARKS) -> None:
    """
    Write messages as a bag of MCAP.

    :param path: of the file, such as ``incident.mcap``; without that suffix, of a folder as
        rosbag2 writes it.
    :param remarks: go into the metadata, as ``custom_data``.
    :raises BagError: something is there already, or there is no place for it.
    :raises InvalidArgumentException: a stamp that no message can hold.
    """
    path = Path(path)
    if path.suffix not in (_SUFFIX, ''):
        raise BagError(f'{path}: a recording is a file {_SUFFIX}, or a folder without a suffix')
    if path.exists():
        raise BagError(f'{path} is there already, and recordings are not replaced')
    try:
        unfinished = Path(mkdtemp(prefix=f'.{path.name}.', dir=path.parent))
        try:
            folder = unfinished / path.stem
            _write(folder, messages, remarks)
            written = folder if not path.suffix else folder / f'{path.stem}{_SUFFIX}'
            written.rename(path)
        finally:
            shutil.rmtree(unfinished)
    except OSError as error:
        raise BagError(f'{path} cannot be written: {error.strerror}') from error


def as_arrived(arrivals: Iterable[Received]) -> Iterator[Message]:
    """Yield messages as they arrived, to be played when they arrived."""
    writer = WireWriter()
    for arrival in arrivals:
        yield Message(max(arrival.received, LATEST), arrival.static, writer.write(arrival.batch))


def messages_of(tree: Tree) -> Iterator[Message]:
    """Yield what a tree holds as messages, in the order in which they are to be played."""
    static = [Sample(str(history.parent), history.child, LATEST, history.sample(LATEST))
              for history in tree.histories.values() if history.is_static]
    moving = heapq.merge(*map(_samples, filter(moves, tree.histories.values())),
                         key=lambda sample: sample.stamp)
    first = next(moving, None)
    if static:
        begin = LATEST if first is None else max(first.stamp, LATEST)
        yield Message(begin, True, as_bytes(static))
    if first is None:
        return
    for stamp, alike in itertools.groupby(itertools.chain([first], moving),
                                          key=lambda sample: sample.stamp):
        while some := list(itertools.islice(alike, _MOST)):
            yield Message(max(stamp, LATEST), False, as_bytes(some))


def _samples(history: MovingHistory) -> Iterator[Sample]:
    """Yield the samples of an edge, those of one stamp in order of arrival."""
    stamps, poses, parents, _ = history.columns()
    if not stamps:
        return
    data = poses.cast('B')
    named = itertools.repeat(str(history.parent)) if parents is None else parents
    for number, (stamp, parent) in enumerate(zip(stamps, named)):  # noqa: B905 - no end
        yield Sample(parent, history.child, stamp, unpack_pose(data, number * POSE_BYTES))


def _write(folder: Path, messages: Iterable[Message], remarks: Mapping[str, str]) -> None:
    try:
        from rosbags.interfaces import (
            Qos,
            QosDurability,
            QosHistory,
            QosLiveliness,
            QosReliability,
            QosTime,
        )
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise needs_extra(error) from error

    def quality(durability: QosDurability, depth: int) -> Qos:
        never = QosTime(0, 0)
        return Qos(QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE, durability, never,
                   never, QosLiveliness.AUTOMATIC, never, False)

    types = get_typestore(Stores.ROS2_JAZZY)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {
            static: writer.add_connection(topic, _TYPE, typestore=types,
                                          offered_qos_profiles=[quality(durability, depth)])
            for static, topic, durability, depth in (
                (True, '/tf_static', QosDurability.TRANSIENT_LOCAL, 1),
                (False, '/tf', QosDurability.VOLATILE, 100))}
        for name, remark in remarks.items():
            writer.set_custom_data(name, remark)
        for message in messages:
            writer.write(topics[message.static], message.time, message.data)
