# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read a bag into a buffer: its transforms, its joint states, and the stamps of other topics."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
import multiprocessing
import os
from pathlib import Path
import sys
from typing import TYPE_CHECKING

import numpy as np
from tf_tree_py.beyond.uncertainty.insertion import Covariances
from tf_tree_py.buffer_core import Snapshot
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.errors import warn
from tf_tree_py.core.messages.byte_cursor import ByteCursor, WireError
from tf_tree_py.core.messages.incidents import Statistics
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import (
    BEGINNING,
    FOREVER,
    format_stamp,
    LATEST,
    UNLIMITED,
)
from tf_tree_py.core.text import listed
from tf_tree_py.core.times import checked_cache_time, checked_stamp, Stamp, Stamps
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.frame_names import edge_filter, FrameFilter
from tf_tree_py.recording.errors import BagError
from tf_tree_py.urdf import joint_tracks, JointState, Robot
from tf_tree_py.urdf.joints import FIXED

from .assembly.assembler import Anomalies, Anomaly, as_text, Assembler, BagWarning
from .assembly.covariances import CovarianceTopics
from .assembly.decoding import Decoder, prefixed, renames
from .files.bag_reader import Bag, PathLike
from .files.connections import Connection, cursor_of

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """
    Show how much of a bag, or how many bags, have been read.

    :param total: how many messages, or bags, there are.
    :return: a function to call with the number of messages or bags just read.
    """
    # A worker shares the terminal of its parent process, which shows the bar.
    alone = multiprocessing.parent_process() is None
    bar = _bar() if alone and sys.stderr.isatty() else None
    if bar is None:
        yield lambda _: None
        return
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda read: bar.advance(task, read)


def _bar() -> 'Progress | None':
    try:
        from rich.console import Console
        from rich.progress import Progress
    except ImportError:  # the bar is optional
        return None
    return Progress(console=Console(stderr=True), transient=True)


_JOINT_STATES = 'sensor_msgs/JointState'


def robot_of(robot: PathLike | Robot) -> Robot:
    """
    Return a robot, or read it from a file.

    :raises BagError: the file cannot be read.
    :raises DescriptionError: the file does not describe a robot.
    """
    if isinstance(robot, Robot):
        return robot
    try:
        return Robot.load(os.fspath(robot))
    except OSError as error:
        raise BagError(f'{robot} cannot be read: {error.strerror}') from error


def _topic_of_joints(bag: Bag, topic: str | None) -> str:
    """
    Return the topic of a bag's joint states.

    :param topic: the topic to check; None: the only topic of joint states.
    :raises BagError: there is none, there are several, or it has messages of another type.
    """
    alike = [each for each in bag.everything if each.short_type == _JOINT_STATES]
    found = sorted({each.topic for each in alike if each.is_of_ros}
                   or {each.topic for each in alike})
    if topic is None and len(found) == 1:
        return found[0]
    if topic in found:
        return topic
    there = ', '.join(found) or 'none'
    if topic is not None:
        raise BagError(f'{bag.path} has no joint states on {topic}; topics with some: {there}')
    raise BagError(f'{bag.path} has joint states on {there}: choose those of the robot with '
                   'joint_topic' if found else f'{bag.path} has no topic with joint states')


def _insert_joints(bag: Bag, robot: Robot, topic: str, start: int | None, stop: int | None,
                   rename: Rename, assembly: Assembler) -> None:
    """
    Add the edges of a robot, except those whose child has recorded transforms.

    :param start: skip messages received before it, nanoseconds; None: read all.
    :param stop: skip messages received at it or later; None: read all.
    :param rename: the new names of the edges.
    :raises BagError: the joint states do not move the robot.
    """
    recorded = set(assembly.tree.histories)
    tracks = joint_tracks(robot, _states(bag, topic, start, stop, assembly.oddities),
                          lambda sentence: assembly.oddities.note('joint states', sentence))
    if not tracks:
        raise BagError(f'{bag.path}: what was recorded on {topic} moves no joint of the robot '
                       f'{robot.name!r}, which has {", ".join(robot.variables) or "none"}')
    for joint in robot.joints:
        edge = rename(*joint.edge)
        if joint.joint_type == FIXED and edge and edge[1] not in recorded:
            assembly.oddities.note_incidents(assembly.intake.insert(
                [Sample(*edge, LATEST, joint.origin)], topic, static=True))
    for track in tracks:
        edge = rename(track.parent, track.child)
        if edge and edge[1] not in recorded:
            assembly.insert_track(track._replace(parent=edge[0], child=edge[1]), topic)


def _states(bag: Bag, topic: str, start: int | None, stop: int | None,
            oddities: Anomalies) -> Iterator[JointState]:
    """Yield the readable messages received from start to stop."""
    readers = {each: JointStateReader(each.ros1) for each in bag.connections_of(topic)}
    begin, end = BEGINNING if start is None else start, FOREVER if stop is None else stop
    for arrival in bag.messages(topic):
        if not begin <= arrival.received < end:
            continue
        try:
            yield readers[arrival.connection].read(arrival.data)
        except ValueError as error:
            oddities.note('unreadable joint states', f'on {topic}: {error}',
                          first=arrival.received)


# --- a bag without transforms

_ODOMETRY, _TF_MESSAGE = 'nav_msgs/Odometry', 'tf2_msgs/TFMessage'


def no_transforms(bag: Bag) -> str:
    """Return the error in one sentence; the bag must be open and not yet read."""
    there = listed(sorted({each.topic for each in bag.everything}), most=20) or 'nothing'
    types = {each.topic: each.short_type for each in bag.everything if each.is_of_ros}
    hints = bag.unread + list(dict.fromkeys(
        f'{each.topic} has {each.contents}, not {_TF_MESSAGE}' for each in bag.everything
        if each.topic.rpartition('/')[2] in ('tf', 'tf_static') and not each.readable_encodings))
    for topic, type_name in types.items():
        if type_name == _ODOMETRY:
            hints.append(f'open_bag(..., odometry={topic!r}) makes an edge of its odometry, as '
                         'Covariances(with_poses=True) does')
        elif type_name == _JOINT_STATES:
            hints.append(f'open_bag(..., robot="robot.urdf") makes edges of the joint states '
                         f'of {topic}')
    return '; '.join([f'{bag.path} has no topic with transforms; it has: {there}', *hints,
                      *bag.damage])


# --- opening

class Recording(Snapshot):
    """
    The transforms of a bag as a buffer that never changes; see ``open_bag``.

    :ivar path: the path of the bag.
    :ivar oddities: the anomalies in it, summarized by reason and edge.
    :ivar statistics: how many transforms were accepted, and how many were refused and why.
    """

    def __init__(self, tree: Tree, path: Path, oddities: Sequence[Anomaly],
                 statistics: Statistics) -> None:
        super().__init__(tree)
        self.path = path
        self.oddities = oddities
        self.statistics = statistics


def open_bag(path: PathLike, *, topics: Sequence[str] | None = None, start: Stamp | None = None,
             stop: Stamp | None = None, frame_prefix: str | Mapping[str, str] = '',
             shared_frames: Collection[str] = (), frames: FrameFilter | None = None,
             cache_time: int = UNLIMITED,
             covariances: Mapping[str, Covariances] | None = None,
             odometry: str | Collection[str] = (),
             robot: PathLike | Robot | None = None, joint_topic: str | None = None) -> Recording:
    """
    Return a recording as a buffer, with all lookups of a buffer.

    It needs no ROS. One ``BagWarning`` lists all anomalies in the bag.

    :param path: a file of rosbag2 (``.mcap``, ``.db3``) or ROS 1 (``.bag``), another MCAP file,
        or a folder of rosbag2.
    :param topics: the topics to read; by default, every topic with TFMessages, or with
        Foxglove's FrameTransform or FrameTransforms. The transforms of topics that end in
        ``_static``, or are transient-local or latched, are valid at all times.
    :param start: skip moving transforms that were received earlier: nanoseconds of the
        recorder's clock, or a ``datetime64``.
    :param stop: skip moving transforms that were received at this time or later.
    :param frame_prefix: a prefix for every frame, such as ``robot1/``, or a dictionary with
        the prefix of each topic.
    :param shared_frames: frames that get no prefix, such as ``map``.
    :param frames: which edges to accept, by their new names: a collection that must contain
        both frames, or a function of (parent, child).
    :param cache_time: the length of each edge's history, nanoseconds; by default, everything.
    :param covariances: topics of Odometry and PoseWithCovarianceStamped, and to which edge
        the covariances of each belong, by its new name. Those of static edges, which
        ``static_transform_publisher`` publishes, are found unless ``topics`` are given.
    :param odometry: topics of Odometry that move edges, from the frame of each message to its
        child; short for ``Covariances(with_poses=True)``.
    :param robot: a robot description or its file. The joint states in the bag move the edges
        that have no recorded transforms.
    :param joint_topic: the topic of the joint states, if there are several.
    :raises BagError: the bag does not exist, cannot be read, or has no transforms.
    :raises DescriptionError: the file does not describe a robot.
    """
    names_of, wanted = prefixed(frame_prefix, shared_frames), edge_filter(frames)
    rename_of = renames(names_of, wanted)
    assembly = Assembler(Decoder(rename_of), checked_cache_time(cache_time))
    covariances = _with_odometry(covariances, odometry)
    described = None if robot is None else robot_of(robot)
    begin, end = (None if each is None else checked_stamp(each) for each in (start, stop))
    with Bag(path, topics) as bag:
        uncertain = CovarianceTopics(bag, covariances, alone=topics is not None)
        joints = None if described is None else _topic_of_joints(bag, joint_topic)
        _check_topics(bag, frame_prefix, joints, uncertain.rules)
        with progress_bar(bag.path.name, bag.expected(uncertain.connections)) as tell:
            assembly.assemble(bag.arrivals(begin, end), tell)
            if described is not None and joints is not None:
                _insert_joints(bag, described, joints, begin, end,
                               rename_of(bag.connections_of(joints)[0]), assembly)
            uncertain.insert_into(assembly, names_of, wanted, begin, end, tell)
        if (begin, end) != (None, None) and not any(map(moves, assembly.tree.histories.values())):
            raise BagError(
                f'{path} has no moving transforms between start and stop: its messages were '
                f'received from {format_stamp(bag.span[0])} to {format_stamp(bag.span[1])} s; '
                'start and stop are integer nanoseconds')
        for sentence in bag.damage:
            assembly.oddities.note('damaged file', sentence)
        for sentence in bag.unread:
            assembly.oddities.note('unread transforms', sentence)
        recording = Recording(assembly.tree, bag.path, assembly.oddities.summed(),
                              assembly.intake.statistics())
    if recording.oddities:
        warn(as_text(path, recording.oddities), BagWarning)
    return recording


def _with_odometry(covariances: Mapping[str, Covariances] | None,
                   odometry: str | Collection[str]) -> Mapping[str, Covariances] | None:
    """Return the rules for the covariances of topics, with those of odometry."""
    topics = [odometry] if isinstance(odometry, str) else odometry
    if not topics:
        return covariances
    return dict.fromkeys(topics, Covariances(with_poses=True)) | dict(covariances or {})


def _check_topics(bag: Bag, frame_prefix: str | Mapping[str, str], joints: str | None,
                  uncertain: Mapping[str, Covariances]) -> None:
    with_poses = joints is not None or any(rules.with_poses for rules in uncertain.values())
    if not bag.connections and not with_poses:
        raise BagError(no_transforms(bag))
    if isinstance(frame_prefix, str):
        return
    if not isinstance(frame_prefix, Mapping):
        raise BagError(f'frame_prefix has to be a string or a dictionary, not {frame_prefix!r}')
    read = {each.topic for each in bag.connections} | {joints} | set(uncertain)
    unknown = set(frame_prefix) - read
    if unknown:
        there = ', '.join(sorted({each.topic for each in bag.everything}))
        raise BagError(f'{bag.path}: frame_prefix names {", ".join(sorted(unknown))}, of which no '
                       f'transforms are read; the bag has: {there}')


# How the first field of a message is read, by its type.
_STAMP_OF = {'std_msgs/msg/Header': ByteCursor.read_stamp,
             'builtin_interfaces/msg/Time': ByteCursor.read_time}


# --- stamps of any topic

def stamps_of(bag: PathLike | Recording, topic: str) -> Stamps:
    """
    Return the stamps in the headers of a topic's messages, in order of arrival.

    The messages may have any type that begins with a Header or a Time. ``lookup_many`` accepts
    these stamps.

    :param bag: a path as for ``open_bag``, or its result.
    :return: (N,) nanoseconds.
    :raises BagError: the bag cannot be read, does not have the topic, or its messages do not
        begin with a stamp.
    """
    with Bag(bag.path if isinstance(bag, Recording) else bag, []) as opened:
        read = {each: _stamp_reader(each, opened) for each in opened.connections_of(topic)}
        stamps = [read[arrival.connection](arrival.data) for arrival in opened.messages(topic)]
    return np.array(stamps, dtype=np.int64)


def _stamp_reader(connection: Connection, bag: Bag) -> Callable[[bytes], int]:
    first = bag.first_field(connection)
    read_field = _STAMP_OF.get(first)
    what = f'{bag.path}: a message of {connection.topic} ({connection.type_name})'
    if read_field is None:
        raise BagError(f'{what} begins with {first or "an unknown field"}, and not with '
                       'a header')

    def read(data: bytes) -> int:
        try:
            return read_field(cursor_of(data, connection.ros1))
        except WireError as error:
            raise BagError(f'{what} has no stamp: {error}') from None

    return read


class JointStateReader:
    """
    Reads the messages of one connection.

    Nearly all messages have the same names as the previous one, which are recognised by their
    bytes.

    :param ros1: whether they are ROS 1's bytes; otherwise they are CDR.
    """

    def __init__(self, ros1: bool) -> None:
        self._ros1 = ros1
        self._known = b''
        self._names: tuple[str, ...] = ()

    def read(self, data: bytes) -> JointState:
        """
        Return the joint states of a message.

        :raises WireError: it ends too soon, or its names are not text.
        """
        cursor = cursor_of(data, self._ros1)
        stamp = cursor.read_stamp()
        names = self._names_at(cursor)
        return JointState(stamp, names, cursor.read_doubles(cursor.read_uint32()))

    def _names_at(self, cursor: ByteCursor) -> tuple[str, ...]:
        """Return the names after the stamp, and move past them."""
        begin = cursor.position
        end = begin + len(self._known)
        if self._known and cursor.data[begin:end] == self._known:
            cursor.position = end
            return self._names
        cursor.read_text()  # frame_id, which has no meaning here
        self._names = tuple([cursor.read_text() for _ in range(cursor.read_uint32())])
        self._known = bytes(cursor.data[begin:cursor.position])
        return self._names
