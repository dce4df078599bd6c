# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Add edges from recorded joint states to the recorded edges."""

from collections.abc import Iterator
import os

from tf_tree_py.core.messages.frame_names import Rename
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import BEGINNING, FOREVER, LATEST
from tf_tree_py.urdf import joint_tracks, JointState, Robot
from tf_tree_py.urdf.joints import FIXED

from .assembly.anomalies import Anomalies
from .assembly.assembler import Assembler
from .errors import BagError
from .files.bag_reader import Bag, PathLike
from .files.joint_states import JointStateReader

JOINT_STATES = 'sensor_msgs/JointState'


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


def topic_of_joints(bag: Bag, topic: str | None) -> str:
    """
    Return the topic of a bag's joint states.

    :param topic: the topic to check; None: the only topic of joint states.
    :raises BagError: there is none, there are several, or it has messages of another type.
    """
    found = sorted({source.topic for source in bag.everything
                    if source.type_name.replace('/msg/', '/') == JOINT_STATES})
    if topic is None and len(found) == 1:
        return found[0]
    if topic in found:
        return topic
    there = ', '.join(found) or 'none'
    if topic is not None:
        raise BagError(f'{bag.path} has no joint states on {topic}; topics with some: {there}')
    raise BagError(f'{bag.path} has joint states on {there}: choose those of the robot with '
                   'joint_topic' if found else f'{bag.path} has no topic with joint states')


def take_joints(bag: Bag, robot: Robot, topic: str, start: int | None, stop: int | None,
                rename: Rename, assembly: Assembler) -> None:
    """
    Add the edges of a robot, except those whose child has recorded transforms.

    :param start: skip messages that were received earlier, nanoseconds; None: none.
    :param stop: skip messages that were received at this time or later.
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
        if joint.kind == FIXED and edge and edge[1] not in recorded:
            assembly.oddities.note_incidents(assembly.intake.take(
                [Sample(*edge, LATEST, joint.origin)], topic, static=True))
    for track in tracks:
        edge = rename(track.parent, track.child)
        if edge and edge[1] not in recorded:
            assembly.take_track(track._replace(parent=edge[0], child=edge[1]), topic)


def _states(bag: Bag, topic: str, start: int | None, stop: int | None,
            oddities: Anomalies) -> Iterator[JointState]:
    """Yield the messages that were received from start to stop and can be read."""
    readers = {source: JointStateReader(source.ros1) for source in bag.sources_of(topic)}
    begin, end = BEGINNING if start is None else start, FOREVER if stop is None else stop
    for arrival in bag.messages(topic):
        if not begin <= arrival.received < end:
            continue
        try:
            yield readers[arrival.source].read(arrival.data)
        except ValueError as error:
            oddities.note('unreadable joint states', f'on {topic}: {error}',
                          first=arrival.received)
