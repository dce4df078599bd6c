# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Topics of any type whose messages carry poses, as transforms of a tree.

A reader returns what a message contains, as ``PoseSample``; those of common types are here, and a
program passes its own for others. What a reader returns is checked as transforms are, and an
exception of a reader is an incident of its topic.
"""

from collections.abc import Callable, Iterable
from typing import Any, cast, NamedTuple, TypeAlias
import weakref

from geometry_msgs.msg import (
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Transform,
    TransformStamped,
)
from nav_msgs.msg import Odometry
import numpy.typing as npt
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from tf_tree_py.beyond.uncertainty.insertion import (
    Covariances,
    EdgeEstimate,
    insert_estimated_pose,
)
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.errors import InvalidArgumentException, TransformException
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.sample import Batch, Edge, ImpossibleStamp
from tf_tree_py.core.stamp import LATEST, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, Stamp

from .feed import Feed, Info
from .spinner import Spinner
from ..buffer.buffer import Buffer
from ..messages.convert import as_nanoseconds, as_pose, TimeLike

# So many layouts of messages are known; a topic with more gets the names of its publishers anew.
_MAX_KNOWN = 256


class PoseSample(NamedTuple):
    """
    The pose of a frame in another, as a message contains it.

    :ivar parent: the frame in whose coordinates the pose is.
    :ivar child: the frame whose pose it is.
    :ivar stamp: a message's or rclpy's time, or nanoseconds; ignored if the topic is static.
    :ivar pose: ``parent_T_child``: a ``Pose`` or ``Transform`` message, or what
        ``BufferCore.insert`` takes.
    :ivar covariance: (6, 6), or 36 numbers as in ``PoseWithCovariance``; None: unknown.
    """

    parent: str
    child: str
    stamp: TimeLike | Stamp
    pose: Pose | Transform | PoseLike
    covariance: npt.ArrayLike | None = None


Said: TypeAlias = PoseSample | Iterable[PoseSample] | None
"""What a reader returns: one pose, several, or none."""


# --- reading messages

def _stamped(message: PoseStamped | TransformStamped) -> PoseSample:
    return PoseSample(message.header.frame_id, getattr(message, 'child_frame_id', ''),
                      message.header.stamp, getattr(message, 'pose', None) or message.transform)


def _with_covariance(message: Odometry | PoseWithCovarianceStamped) -> PoseSample:
    return PoseSample(message.header.frame_id, getattr(message, 'child_frame_id', ''),
                      message.header.stamp, message.pose.pose, message.pose.covariance)


_READERS: dict[type, Callable[[Any], PoseSample]] = {
    Odometry: _with_covariance,
    PoseStamped: _stamped,
    PoseWithCovarianceStamped: _with_covariance,
    TransformStamped: _stamped,
}
_NAME_NO_CHILD = PoseStamped, PoseWithCovarianceStamped


def reader_of(msg_type: type, child: str | None) -> Callable[[Any], PoseSample]:
    """
    Return the reader of a common type.

    :param child: the frame whose pose the messages contain; None: they name it.
    :raises ValueError: there is none for the type, or neither names the frame.
    """
    name = msg_type.__name__
    if msg_type not in _READERS:
        known = ', '.join(sorted(each.__name__ for each in _READERS))
        raise ValueError(f'{name} needs a function that reads it: pass read=..., which returns '
                         f'a PoseSample for a message. Without it: {known}')
    if msg_type in _NAME_NO_CHILD and not child:
        raise ValueError(f'a {name} does not name the frame whose pose it contains: pass '
                         "child=..., such as 'base_link'")
    return _READERS[msg_type]


def _pose_of(given: Any) -> PoseTuple:
    if isinstance(given, Transform):
        return as_pose(given)
    if not isinstance(given, Pose):
        return checked_pose(given)
    t, q = given.position, given.orientation
    return (float(t.x), float(t.y), float(t.z),
            float(q.x), float(q.y), float(q.z), float(q.w))


def _stamp_of(given: Any) -> int | tuple[int, int]:
    """Return nanoseconds; or, if they are impossible, the two numbers of the message."""
    if hasattr(given, 'nanosec') and given.nanosec >= NANOSECONDS_PER_SECOND:
        return given.sec, given.nanosec
    is_ros = hasattr(given, 'nanosec') or isinstance(given, Time)
    return as_nanoseconds(given, Time) if is_ros else checked_stamp(given)


# --- one topic

class PoseFeed(Feed):
    """Stores the poses that the messages of one topic carry."""

    def __init__(self, buffer: Buffer, node: Node, topic: str, static: bool, qos: QoSProfile | int,
                 names: Rename, spinner: Spinner, msg_type: type,
                 read: Callable[[Any], Said], owner: Node, edge: tuple[str | None, str | None],
                 planar: bool | None) -> None:
        """
        Begin to receive.

        :param names: the new names of an edge.
        :param read: returns what a message contains.
        :param owner: the user's node, which this does not keep alive.
        :param edge: the parent and the child, which replace those in the messages; None: they
            stay.
        :param planar: see ``Covariances``; None: use no covariances.
        """
        super().__init__(buffer, node, topic, static, spinner)
        self._names, self._read, self._edge = names, _weakly(read, owner), edge
        self._uses_covariances = planar is not None
        self._rules = Covariances(with_poses=True, planar=bool(planar))
        self._known: set[tuple[Edge, ...]] = set()
        self._type = f'a message of type {msg_type.__name__}'
        self._subscribe(msg_type, self._receive, qos)

    def _receive(self, message: Any, info: Info) -> None:
        self._spinner.note()
        authority = self._authority.name()
        estimates = []
        try:
            for sample in _each(self._read(message)):
                judged = self._judged(sample, authority)
                if isinstance(judged, Incident):
                    self._refuse(judged)
                elif judged is not None:
                    estimates.append(judged)
        except Exception as error:  # noqa: B902 - a reader may raise anything
            self._refuse(self._unreadable(error, authority))
        if estimates:
            self._store(estimates, info)

    def _judged(self, sample: PoseSample, authority: str) -> EdgeEstimate | Incident | None:
        """Return what a reader returned, checked; None: it is not wanted."""
        try:
            found = self._estimate(sample)
            return None if found is None else self._rules.judged(found, authority)
        except (ArithmeticError, AttributeError, TransformException, TypeError,
                ValueError) as error:
            return self._unreadable(error, authority)

    def _unreadable(self, error: Exception, authority: str) -> Incident:
        return Incident(Kind.MALFORMED, '', '', LATEST, authority,
                        f'{self._topic}: {self._type} cannot be read: '
                        f'{type(error).__name__}: {error}')

    def _estimate(self, sample: PoseSample) -> EdgeEstimate | ImpossibleStamp | None:
        """Return what a reader returned, with the names of the tree; None: it is not wanted."""
        if not isinstance(sample, PoseSample):
            raise InvalidArgumentException(
                f'a reader returns PoseSample, several or None, and not {sample!r}')
        named = [name if given is None else given
                 for name, given in zip(sample[:2], self._edge, strict=True)]
        if not all(isinstance(name, str) for name in named):
            raise InvalidArgumentException(f'the frames {named[0]!r} and {named[1]!r} must be '
                                           'strings')
        edge = self._names(*named)
        if edge is None:
            return None
        stamp = LATEST if self._static else _stamp_of(sample.stamp)
        if isinstance(stamp, tuple):
            return ImpossibleStamp(*edge, *stamp)
        return EdgeEstimate(*edge, stamp, _pose_of(sample.pose), cast(
            'Array | None', sample.covariance if self._uses_covariances else None))

    def _store(self, estimates: list[EdgeEstimate], info: Info) -> None:
        batch = Batch([(each.parent, each.child) for each in estimates],
                      [each.stamp for each in estimates],
                      [pack_pose(*each.pose) for each in estimates])
        authority = self._announce(batch, self._is_new(tuple(batch.edges)))
        if all(each.covariance is None and each.fault is None for each in estimates):
            self._insert(batch, authority)
        else:
            for each in estimates:
                self._buffer.feeds.note(self._authority.correct(insert_estimated_pose(
                    self._buffer.intake, each, authority, static=self._static, announced=True)))
        self._report(self._duplicates.judge(batch, info))

    def _is_new(self, edges: tuple[Edge, ...]) -> bool:
        if edges in self._known:
            return False
        if len(self._known) >= _MAX_KNOWN:
            self._known.clear()
        self._known.add(edges)
        return True


def _weakly(read: Callable[[Any], Said], node: Node) -> Callable[[Any], Said]:
    """Return a reader that does not keep alive the node whose method it is."""
    if getattr(read, '__self__', None) is not node:
        return read
    method = weakref.WeakMethod(read)
    return lambda message: alive(message) if (alive := method()) is not None else None


def _each(said: Said) -> Iterable[PoseSample]:
    if said is None:
        return ()
    return (said,) if isinstance(said, PoseSample) else said
