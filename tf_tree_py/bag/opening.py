# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read a bag into a buffer."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any
import warnings

from tf_tree_py.beyond.uncertainty.insertion import Covariances
from tf_tree_py.buffer_core import Snapshot
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.messages.frame_names import FrameFilter, rename
from tf_tree_py.core.messages.incidents import Statistics
from tf_tree_py.core.stamp import format_stamp, UNLIMITED
from tf_tree_py.core.times import checked_cache_time, checked_stamp
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.urdf import Robot

from .assembly.anomalies import Anomaly, as_text, BagWarning
from .assembly.assembler import Assembler
from .assembly.covariances import CovarianceTopics
from .assembly.decoding import Decoder, prefixed, renames
from .errors import BagError
from .files.bag_reader import Bag, PathLike
from .joints import robot_of, take_joints, topic_of_joints
from .no_transforms import no_transforms
from .progress import progress_bar


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


def open_bag(path: PathLike, *, topics: Sequence[str] | None = None, start: Any = None,
             stop: Any = None, frame_prefix: str | Mapping[str, str] = '',
             shared_frames: Collection[str] = (), frames: FrameFilter | None = None,
             cache_time: int = UNLIMITED,
             covariances: Mapping[str, Covariances] | None = None,
             odometry: str | Collection[str] = (),
             robot: PathLike | Robot | None = None, joint_topic: str | None = None) -> Recording:
    """
    Return a recording as a buffer, with all lookups of a buffer.

    It needs no ROS. One ``BagWarning`` lists all anomalies in the bag.

    :param path: a file of rosbag2 (``.mcap``, ``.db3``) or ROS 1 (``.bag``), or a folder of
        rosbag2.
    :param topics: the topics to read; by default, every topic of type TFMessage. The
        transforms of topics that end in ``_static``, or are transient-local or latched, are
        valid at all times.
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
    names_of, wanted = prefixed(frame_prefix, shared_frames), rename(frame_filter=frames)
    rename_of = renames(names_of, wanted)
    assembly = Assembler(Decoder(rename_of), checked_cache_time(cache_time))
    covariances = _with_odometry(covariances, odometry)
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
                f'{path} has no moving transforms between start and stop: its messages were '
                f'received from {format_stamp(bag.span[0])} to {format_stamp(bag.span[1])} s; '
                'start and stop are integer nanoseconds')
        for sentence in bag.damage:
            assembly.oddities.note('damaged file', sentence)
        recording = Recording(assembly.tree, bag.path, assembly.oddities.summed(),
                              assembly.intake.statistics())
    if recording.oddities:
        warnings.warn(as_text(path, recording.oddities), BagWarning, stacklevel=2)
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
    if not bag.sources and not with_poses:
        raise BagError(no_transforms(bag))
    if isinstance(frame_prefix, str):
        return
    if not isinstance(frame_prefix, Mapping):
        raise BagError(f'frame_prefix has to be a string or a dictionary, not {frame_prefix!r}')
    read = {source.topic for source in bag.sources} | {joints} | set(uncertain)
    unknown = set(frame_prefix) - read
    if unknown:
        there = ', '.join(sorted({source.topic for source in bag.everything}))
        raise BagError(f'{bag.path}: frame_prefix names {", ".join(sorted(unknown))}, of which no '
                       f'transforms are read; the bag has: {there}')
