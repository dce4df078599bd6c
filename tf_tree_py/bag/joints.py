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

"""What recorded joint states say of a robot becomes edges, beside those that were recorded."""

from collections.abc import Iterator
import os

from tf_tree_py.core.arrivals.frame_names import Rename
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.stamp import BEGINNING, FOREVER, LATEST
from tf_tree_py.urdf import joint_tracks, JointState, Robot
from tf_tree_py.urdf.joints import FIXED

from .assembling.assembly import Assembly
from .assembling.oddities import Oddities
from .errors import BagError
from .files.joint_states import JointStateReader
from .files.reading import Bag, PathLike

_TYPE = 'sensor_msgs/JointState'


def robot_of(robot: PathLike | Robot) -> Robot:
    """
    Return a robot, or that of a file.

    :raises BagError: the file cannot be read.
    :raises DescriptionError: it describes no robot.
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

    :param topic: the one that is meant; None: the only one.
    :raises BagError: there is none, there are several, or it has other messages.
    """
    found = sorted({source.topic for source in bag.everything
                    if source.type_name.replace('/msg/', '/') == _TYPE})
    if topic is None and len(found) == 1:
        return found[0]
    if topic in found:
        return topic
    there = ', '.join(found) or 'none'
    if topic is not None:
        raise BagError(f'{bag.path} has no joint states on {topic}; topics with some: {there}')
    raise BagError(f'{bag.path} has joint states on {there}: joint_topic says which are the '
                   "robot's" if found else f'{bag.path} has no topic with joint states')


def take_joints(bag: Bag, robot: Robot, topic: str, start: int | None, stop: int | None,
                rename: Rename, assembly: Assembly) -> None:
    """
    Add the edges of a robot; those whose child has recorded transforms stay as they were.

    :param start: leave out what was received before, nanoseconds; None: nothing.
    :param stop: leave out what was received then or later.
    :param rename: how the edges are called.
    :raises BagError: nothing in the joint states moves the robot.
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
            oddities: Oddities) -> Iterator[JointState]:
    """Yield what was received from start to stop, without what cannot be read."""
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
