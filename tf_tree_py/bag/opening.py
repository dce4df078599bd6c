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

"""A bag becomes a buffer."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any
import warnings

from tf_tree_py.core.arrivals.estimate import Covariances
from tf_tree_py.core.arrivals.frame_names import FrameFilter, rename
from tf_tree_py.core.arrivals.incidents import Statistics
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.stamp import format_stamp, UNLIMITED
from tf_tree_py.core.times import checked_cache_time, checked_stamp
from tf_tree_py.core.tree.queries import Snapshot
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.urdf import Robot

from .assembling.assembly import Assembly
from .assembling.covariances import CovarianceTopics
from .assembling.decoding import Decoder, prefixed, renames
from .assembling.oddities import as_text, BagWarning, Oddity
from .errors import BagError
from .files.reading import Bag, PathLike
from .joints import robot_of, take_joints, topic_of_joints
from .progress import progress_bar


class Recording(Snapshot):
    """
    What a bag holds, as a buffer that never changes; see ``open_bag``.

    :ivar path: of the bag.
    :ivar oddities: what is odd in it, summed up by reason and edge.
    :ivar statistics: how many transforms were taken, and how many were refused and why.
    """

    def __init__(self, tree: Tree, path: Path, oddities: Sequence[Oddity],
                 statistics: Statistics) -> None:
        super().__init__(tree)
        self.path = path
        self.oddities = oddities
        self.statistics = statistics


def open_bag(path: PathLike, *, topics: Sequence[str] | None = None, start: Any = None,
             stop: Any = None, frame_prefix: str | Mapping[str, str] = '',
             shared_frames: Collection[str] = (), frames: FrameFilter | None = None,
             cache_time: int = UNLIMITED,
             covariances: Mapping[str, Covariances] | None = None,
             robot: PathLike | Robot | None = None, joint_topic: str | None = None) -> Recording:
    """
    Return a recording as a buffer, which answers whatever a buffer answers.

    Needs no ROS. What is odd in the bag is warned of, all in one ``BagWarning``.

    :param path: a file of rosbag2 (``.mcap``, ``.db3``) or ROS 1 (``.bag``), or a folder
        as rosbag2 writes it.
    :param topics: read these and no others; every topic of type TFMessage unless given.
        Those whose name ends in ``_static``, and transient-local or latched ones, are valid
        at all times.
    :param start: leave out moving transforms that were received before: nanoseconds of the
        recorder's clock, or a ``datetime64``.
    :param stop: leave out moving transforms that were received then or later.
    :param frame_prefix: what to write before every frame, such as ``robot1/``; or a
        dictionary with that of each topic.
    :param shared_frames: frames that get no prefix, such as ``map``.
    :param frames: which edges to take, by their new names: a collection that both frames
        have to be in, or a function of (parent, child).
    :param cache_time: how much history each edge keeps, nanoseconds; everything unless
        given.
    :param covariances: topics of Odometry and PoseWithCovarianceStamped, and to which edge
        the covariances of each belong, by its new name. Those of static edges, which
        ``static_transform_publisher`` tells, are found unless ``topics`` are given.
    :param robot: its description, a file or read: the bag's joint states move the edges
        that have no recorded transforms.
    :param joint_topic: of these joint states, where there are several.
    :raises BagError: there is no bag, it cannot be read at all, or nothing in it is a
        transform.
    :raises DescriptionError: the robot's file describes none.
    """
    names_of, wanted = prefixed(frame_prefix, shared_frames), rename(frame_filter=frames)
    rename_of = renames(names_of, wanted)
    assembly = Assembly(Decoder(rename_of), checked_cache_time(cache_time))
    described = None if robot is None else robot_of(robot)
    begin, end = (None if each is None else checked_stamp(each) for each in (start, stop))
    with Bag(path, topics) as bag:
        uncertain = CovarianceTopics(bag, covariances, alone=topics is not None)
        joints = None if described is None else topic_of_joints(bag, joint_topic)
        _check_topics(bag, frame_prefix, joints, uncertain.rules)
        with progress_bar(bag.path.name, bag.expected(uncertain.sources)) as tell:
            assembly.take(bag.arrivals(begin, end), tell)
            if described is not None and joints is not None:
                take_joints(bag, described, joints, begin, end,
                            rename_of(bag.sources_of(joints)[0]), assembly)
            uncertain.take_into(assembly, names_of, wanted, begin, end, tell)
        if (begin, end) != (None, None) and not any(map(moves, assembly.tree.histories.values())):
            raise BagError(
                f'{path} has nothing that moves between start and stop: its messages were '
                f'received from {format_stamp(bag.span[0])} to {format_stamp(bag.span[1])} s, '
                'which start and stop have as integer nanoseconds')
        for sentence in bag.damage:
            assembly.oddities.note('damaged file', sentence)
        recording = Recording(assembly.tree, bag.path, assembly.oddities.summed(),
                              assembly.intake.statistics())
    if recording.oddities:
        warnings.warn(as_text(path, recording.oddities), BagWarning, stacklevel=2)
    return recording


def _check_topics(bag: Bag, frame_prefix: str | Mapping[str, str], joints: str | None,
                  uncertain: Mapping[str, Covariances]) -> None:
    there = ', '.join(sorted({source.topic for source in bag.everything})) or 'nothing'
    with_poses = joints is not None or any(rules.with_poses for rules in uncertain.values())
    if not bag.sources and not with_poses:
        raise BagError(f'{bag.path} has no topic with transforms; it has: {there}')
    if isinstance(frame_prefix, str):
        return
    if not isinstance(frame_prefix, Mapping):
        raise BagError(f'frame_prefix is a text, or a dictionary of topics, not {frame_prefix!r}')
    read = {source.topic for source in bag.sources} | {joints} | set(uncertain)
    unknown = set(frame_prefix) - read
    if unknown:
        raise BagError(f'{bag.path}: frame_prefix names {", ".join(sorted(unknown))}, of which no '
                       f'transforms are read; the bag has: {there}')
