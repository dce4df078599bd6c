# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Write a buffer as a bag, which players and viewers of ROS 2 open."""

from collections.abc import Iterable, Iterator, Mapping
import heapq
import itertools
import os
from pathlib import Path
import shutil
from tempfile import mkdtemp
from typing import NamedTuple, TYPE_CHECKING

from tf_tree_py.core.edges.packed import POSE_BYTES, unpack_pose
from tf_tree_py.core.edges.protocol import moves, MovingHistory
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import WireWriter, write as as_bytes
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.tree import Tree

from .errors import BagError, needs_extra

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Writer

_TYPE = 'tf2_msgs/msg/TFMessage'
_SUFFIX = '.mcap'
# The most transforms of one stamp in one message; more go into several messages.
_MOST = 1000
_NO_REMARKS: Mapping[str, str] = {}


class Message(NamedTuple):
    """One message to record: its time of playback, nanoseconds, and its bytes."""

    time: int
    static: bool
    data: bytes


def record(tree: Tree, path: str | os.PathLike[str]) -> None:
    """
    Write a tree as a bag of MCAP. The tree must not change during the call.

    ``/tf_static`` comes first and is transient local, so that late subscribers of a player
    receive it. ``/tf`` follows in order of the stamps, which are also the times of playback. A
    curve becomes poses (``EdgeCurve.shown_at``). A bag cannot store covariances, nor the
    measurements of a gyroscope between two poses. Parameters and errors are those of ``write``.
    """
    write(_messages_of(tree), path)


def write(messages: Iterable[Message], path: str | os.PathLike[str],
          remarks: Mapping[str, str] = _NO_REMARKS) -> None:
    """
    Write messages as a bag of MCAP.

    :param path: a file such as ``incident.mcap``, or without that suffix, a folder in the
        layout of rosbag2.
    :param remarks: the ``custom_data`` of the metadata.
    :raises BagError: the path exists, or cannot be written.
    :raises InvalidArgumentException: a stamp does not fit into a message.
    """
    path = Path(path)
    if path.suffix not in (_SUFFIX, ''):
        raise BagError(f'{path}: a recording is a {_SUFFIX} file, or a folder without a suffix')
    if path.exists():
        raise BagError(f'{path} exists already, and recordings are not overwritten')
    try:
        unfinished = Path(mkdtemp(prefix=f'.{path.name}.', dir=path.parent))
        try:
            folder = unfinished / path.stem
            _write(folder, messages, remarks)
            written = folder if not path.suffix else folder / f'{path.stem}{_SUFFIX}'
            written.rename(path)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    except OSError as error:
        raise BagError(f'{path} cannot be written: {error.strerror}') from error


def as_arrived(arrivals: Iterable[ReceivedMessage]) -> Iterator[Message]:
    """Yield messages in order of arrival, with the arrival as the time of playback."""
    writer = WireWriter()
    for arrival in arrivals:
        yield Message(max(arrival.received, LATEST), arrival.static, writer.write(arrival.batch))


def _messages_of(tree: Tree) -> Iterator[Message]:
    """Yield the transforms of a tree as messages, in order of playback."""
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
    """Yield the samples of an edge; samples with equal stamps in order of arrival."""
    stamps, poses, parents, _ = history.columns()
    if not stamps:
        return
    data = poses.cast('B')
    named = itertools.repeat(str(history.parent)) if parents is None else parents
    for number, (stamp, parent) in enumerate(zip(stamps, named)):  # noqa: B905 - no end
        yield Sample(parent, history.child, stamp, unpack_pose(data, number * POSE_BYTES))


def _write(folder: Path, messages: Iterable[Message], remarks: Mapping[str, str]) -> None:
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
    except ImportError as error:
        raise needs_extra(error) from error

    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = _add_topics(writer)
        for name, remark in remarks.items():
            writer.set_custom_data(name, remark)
        for message in messages:
            writer.write(topics[message.static], message.time, message.data)


def _add_topics(writer: 'Writer') -> 'dict[bool, Connection]':
    """Add both topics to a bag; return the one of static transforms under True."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )
    from rosbags.typesys import get_typestore, Stores

    def quality(durability: QosDurability, depth: int) -> Qos:
        never = QosTime(0, 0)
        return Qos(QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE, durability, never,
                   never, QosLiveliness.AUTOMATIC, never, False)

    types = get_typestore(Stores.ROS2_JAZZY)
    return {
        static: writer.add_connection(topic, _TYPE, typestore=types,
                                      offered_qos_profiles=[quality(durability, depth)])
        for static, topic, durability, depth in (
            (True, '/tf_static', QosDurability.TRANSIENT_LOCAL, 1),
            (False, '/tf', QosDurability.VOLATILE, 100))}
