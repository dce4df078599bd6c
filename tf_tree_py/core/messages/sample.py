# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One transform as it arrives, before it is inserted into the tree; and many of one edge.

Samples from bytes, from messages and from callers are all checked here, so the checks
of tf2 (names, NaN, quaternions) are implemented once.

The samples of a track are checked all at once, with the same result as one by one: the same
samples are refused, for the same reasons. Samples that cannot be checked together are inserted
one by one.
"""

from collections.abc import Iterable, Iterator, Sequence
import math
from typing import Any, NamedTuple

import numpy as np

from .incidents import Incident, Kind
from ..edges.packed import POSE_BYTES, unpack_pose
from ..edges.protocol import MovingHistory
from ..errors import InvalidArgumentException
from ..geometry import so3
from ..geometry.poses import checked_poses, is_sound, judged
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp, NANOSECONDS_PER_SECOND
from ..text import shorten
from ..times import checked_stamp, Mask, Stamps

# Up to this number of poses, plain floats are cheaper than an array.
_FEW = 6

# An incident about a refused name shows this number of its characters.
_NAME_IN_TEXT = 60

# The ranges of int32 sec and uint32 nanosec in a message. The nanoseconds may exceed a second,
# so the last stamp is some seconds after the last sec.
_MIN_SEC, _MAX_SEC = -2**31, 2**31 - 1
_MAX_NANOSEC = 2**32 - 1


class Sample(NamedTuple):
    """``parent_T_child`` at a stamp in nanoseconds; its numbers are not checked yet."""

    parent: str
    child: str
    stamp: int
    pose: PoseTuple


class ImpossibleStamp(NamedTuple):
    """
    The stamp of a moving transform whose nanoseconds are a second or more.

    The number is wrong, so the time that was meant is unknown.
    """

    parent: str
    child: str
    sec: int
    nanosec: int

    def incident(self, authority: str) -> Incident:
        """Return the incident of the transform, which is refused."""
        parent, child, sec, nanosec = self
        return Incident(
            Kind.IMPOSSIBLE_STAMP, parent, child, sec * NANOSECONDS_PER_SECOND, authority,
            f'header.stamp.nanosec is {nanosec} (sec is {sec}), and must be below a second, '
            f'{NANOSECONDS_PER_SECOND}: the node that stamps it computes it wrongly')


Edge = tuple[str, str]
"""A parent and a child."""


class Edges(tuple[Edge, ...]):
    """
    The edges of all messages of one layout, which never change.

    :ivar key: stands for this object in a tree's cache; no other object that exists has the same.
    """

    key: object

    def __new__(cls, edges: Iterable[Edge]) -> 'Edges':
        """Return the edges with a key of their own."""
        made = super().__new__(cls, edges)
        made.key = object()
        return made


class Batch(NamedTuple):
    """
    The transforms of one message, packed; its numbers are not checked yet.

    :ivar edges: (parent, child) of each, without leading slashes. Those of a layout are ``Edges``,
        so that a tree finds them faster.
    :ivar stamps: of each, nanoseconds.
    :ivar poses: of each, metres and quaternion x y z w: seven doubles in the machine's
        byte order, as ``edges.packed.pack_pose`` returns them.
    :ivar slashed: the names that arrived with a leading slash, including the slash.
    :ivar impossible: the stamps of the moving transforms that are left out, because they have
        no time.
    """

    edges: Sequence[Edge]
    stamps: Sequence[int]
    poses: Sequence[bytes]
    slashed: Sequence[str] = ()
    impossible: Sequence[ImpossibleStamp] = ()

    @property
    def layout(self) -> object:
        """Return what is equal for batches with the same edges, and fast to compare."""
        edges = self.edges
        return edges.key if type(edges) is Edges else tuple(edges)

    def part(self, places: Sequence[int]) -> 'Batch':
        """Return some of the transforms."""
        return self._replace(edges=[self.edges[place] for place in places],
                             stamps=[self.stamps[place] for place in places],
                             poses=[self.poses[place] for place in places])

    def samples(self) -> list[Sample]:
        """Return the transforms one by one."""
        return [Sample(parent, child, stamp, unpack_pose(pose)) for (parent, child), stamp, pose
                in zip(self.edges, self.stamps, self.poses, strict=True)]

    def parts(self, most: int) -> Iterator['Batch']:
        """Return the transforms in batches of at most this many; names with slashes are lost."""
        for begin in range(0, len(self.edges), most):
            some = slice(begin, begin + most)
            yield Batch(self.edges[some], self.stamps[some], self.poses[some])
        if self.impossible:
            yield Batch((), (), (), impossible=self.impossible)


def admitted(sample: Sample) -> Sample:
    """
    Return a caller's sample with checked names and a checked stamp.

    Removes one leading slash from each name, as tf2 does.

    :raises InvalidArgumentException: a name is not a string, or the stamp is not a stamp.
    """
    parent, child, stamp, pose = sample
    if not isinstance(parent, str) or not isinstance(child, str):
        raise InvalidArgumentException(
            f'Invalid argument: the frames {parent!r} and {child!r} must be strings')
    if type(stamp) is int and BEGINNING <= stamp < FOREVER and (
            parent[:1] != '/' != child[:1]):
        return sample
    return Sample(
        parent.removeprefix('/'), child.removeprefix('/'), checked_stamp(stamp), pose)


def checked_frame(child: object) -> str:
    """
    Return the name of a caller's child frame, without a leading slash.

    :raises InvalidArgumentException: it is not a name.
    """
    if not isinstance(child, str) or not child.removeprefix('/'):
        raise InvalidArgumentException(f'child must be the name of a frame, not {child!r}')
    return child.removeprefix('/')


def message_stamp(message: Any) -> int:
    """
    Return the stamp in the header of a message, in nanoseconds.

    :param message: of rclpy or of rosbags; only its header is read.
    """
    time = message.header.stamp
    return int(time.sec) * NANOSECONDS_PER_SECOND + int(time.nanosec)


def impossible_stamp(message: Any) -> ImpossibleStamp | None:
    """
    Return the stamp in the header of a message if it is impossible, otherwise None.

    :param message: as for ``message_stamp``; if it names no child frame, '' stands for it.
    """
    time = message.header.stamp
    # tf2 accepts a Time of rclpy in a header, too.
    if getattr(time, 'nanosec', 0) < NANOSECONDS_PER_SECOND:
        return None
    return ImpossibleStamp(message.header.frame_id.removeprefix('/'),
                           getattr(message, 'child_frame_id', '').removeprefix('/'),
                           int(time.sec), int(time.nanosec))


def as_sec_nanosec(stamp: int) -> tuple[int, int]:
    """
    Return a stamp as the two numbers of a message.

    :raises InvalidArgumentException: the stamp is before 1901 or after 2038, which a message
        cannot hold.
    """
    sec, nanosec = divmod(stamp, NANOSECONDS_PER_SECOND)
    if _MIN_SEC <= sec <= _MAX_SEC:
        return sec, nanosec
    nanosec += (sec - _MAX_SEC) * NANOSECONDS_PER_SECOND
    if 0 <= nanosec <= _MAX_NANOSEC:
        return _MAX_SEC, nanosec
    raise InvalidArgumentException(
        f'Invalid argument stamp {format_stamp(stamp)} s: no message can hold it, because the '
        'seconds of a message have 32 bits, from 1901 to 2038')


def bad_name(parent: str, child: str, stamp: int, authority: str,
             max_bytes: int) -> Incident | None:
    """Return an incident if one of an edge's two names is invalid, otherwise None."""
    for name in (parent, child):
        fault = _name_fault(name, max_bytes)
        if fault:
            return Incident(Kind.BAD_NAME, parent, child, stamp, authority,
                            f'{shorten(repr(name), _NAME_IN_TEXT)}: {fault}')
    return None


def _name_fault(name: str, max_bytes: int) -> str:
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        return 'it cannot be encoded in UTF-8'
    if size > max_bytes:
        return f'it has {size} bytes; the buffer accepts {max_bytes} (max_name_bytes)'
    return 'it contains a NUL, which ends every string in ROS' if '\0' in name else ''


def sound_poses(poses: Sequence[bytes]) -> Sequence[bytes] | None:
    """Return a batch's poses with unit quaternions; None if one of them needs ``checked``."""
    if len(poses) <= _FEW:
        for pose in poses:
            if not is_sound(unpack_pose(pose)):
                return None
        return poses
    array = np.frombuffer(b''.join(poses)).reshape(-1, 7)
    unit, good = judged(array)
    if unit is array:
        return poses
    if not good.all():
        return None
    packed = unit.tobytes()
    return [packed[begin:begin + POSE_BYTES] for begin in range(0, len(packed), POSE_BYTES)]


def checked(sample: Sample, authority: str) -> Sample | Incident:
    """
    Return a sample that the tree can take, or an incident with the reason why it cannot.

    Normalises the quaternion, as tf2 does. Refuses what tf2 refuses, and also infinities,
    which would become NaN on the first composition.

    :param sample: see ``admitted``.
    """
    parent, child, stamp, pose = sample

    def refused(kind: Kind, detail: str) -> Incident:
        return Incident(kind, parent, child, stamp, authority, detail)

    if not parent or not child:
        missing = 'child_frame_id' if not child else 'header.frame_id'
        return refused(Kind.EMPTY_FRAME, f'{missing} is not set')
    if parent == child:
        return refused(Kind.SELF_EDGE, 'frame_id and child_frame_id are the same')
    if not all(map(math.isfinite, (*pose, math.hypot(*pose[3:])))):
        return refused(Kind.NOT_FINITE, f'(x y z, qx qy qz qw) = {pose}')
    if is_sound(pose):
        return Sample(parent, child, stamp, pose)
    x, y, z, qx, qy, qz, qw = pose
    if not (qx or qy or qz or qw):
        return refused(Kind.ZERO_ROTATION,
                       'was the message left unset? To send no rotation, set it to 0 0 0 1')
    return Sample(parent, child, stamp, (x, y, z, *so3.normalize((qx, qy, qz, qw))))


# --- many samples of one edge

class SampleTrack(NamedTuple):
    """
    Samples of one edge in the order in which they arrive.

    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (N, 7) ``parent_T_child``.
    """

    parent: str
    child: str
    stamps: Stamps
    poses: Array

    @property
    def span(self) -> int:
        """Return the time between the earliest and the latest stamp, nanoseconds."""
        return int(self.stamps.max()) - int(self.stamps.min()) if len(self.stamps) else 0

    def gone(self, window: int) -> str:
        """Return a sentence saying that a window is too short for the track."""
        return (f'Samples of {self.parent!r} -> {self.child!r} span {format_span(self.span)}, and '
                f'the buffer keeps {format_span(window)}: older samples were dropped. '
                'cache_time=UNLIMITED keeps everything')

    def sample(self, number: int) -> Sample:
        """Return one sample by its number."""
        x, y, z, qx, qy, qz, qw = self.poses[number].tolist()
        return Sample(self.parent, self.child, int(self.stamps[number]),
                      (x, y, z, qx, qy, qz, qw))

    def samples(self, begin: int = 0) -> list[Sample]:
        """Return the samples from a number on."""
        return [self.sample(number) for number in range(begin, len(self.stamps))]

    def earliest_after(self) -> Stamps:
        """Return the earliest stamp of each sample and all after it, (N,)."""
        return np.minimum.accumulate(self.stamps[::-1])[::-1]

    def judged(self, authority: str) -> 'JudgedTrack':
        """Return the track with unit quaternions, and the incidents of refused samples."""
        poses, good = judged(self.poses)
        refused = {}
        for number in np.flatnonzero(~good).tolist():
            incident = checked(self.sample(number), authority)
            assert isinstance(incident, Incident)
            refused[number] = incident
        return JudgedTrack(self._replace(poses=poses), good, refused)

    def is_within(self, history: MovingHistory) -> bool:
        """Return whether no sample is older than the history's window when it is inserted."""
        window, latest = history.cache_time, history.newest_stamp
        assert latest is not None
        if not len(self.stamps):
            return True
        newest = max(latest, int(self.stamps.max()))
        if newest - int(self.stamps.min()) <= window:
            return True
        if window >= FOREVER:
            return False  # one by one: the difference overflows 64 bits
        before = np.maximum.accumulate(np.concatenate([[latest], self.stamps[:-1]]))
        return bool((self.stamps >= np.maximum(before, BEGINNING + window) - window).all())


class JudgedTrack(NamedTuple):
    """
    A track whose poses were checked.

    :ivar good: (N,) whether each sample can be taken.
    :ivar refused: the incidents of the others, by the sample's number.
    """

    track: SampleTrack
    good: Mask
    refused: dict[int, Incident]

    def after(self, number: int) -> tuple[SampleTrack, list[Incident]]:
        """Return the good samples from a number on, and the incidents of the others there."""
        track, good = self.track, self.good[number:]
        stamps, poses = track.stamps[number:], track.poses[number:]
        if self.refused:
            stamps, poses = stamps[good], poses[good]
        return (track._replace(stamps=stamps, poses=poses),
                [incident for index, incident in self.refused.items() if index >= number])


def checked_track(parent: str, child: str, stamps: Stamps, poses: object) -> SampleTrack:
    """
    Return a caller's samples.

    :raises InvalidArgumentException: names that are not strings, or mismatched shapes.
    """
    for name, frame in (('parent', parent), ('child', child)):
        if not isinstance(frame, str):
            raise InvalidArgumentException(f'{name} is the name of a frame, not {frame!r}')
    array = checked_poses(poses) if len(stamps) or np.asarray(poses).size else np.empty((0, 7))
    if len(array) != len(stamps):
        raise InvalidArgumentException(
            f'there must be one pose (N, 7) for each stamp (N,): not {len(stamps)} stamps and '
            f'{len(array)} poses')
    return SampleTrack(parent.removeprefix('/'), child.removeprefix('/'), stamps, array)
