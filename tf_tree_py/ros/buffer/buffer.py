# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2's ``Buffer``: the core with messages, clocks and timeouts; here its lookups.

They only convert; ``BufferCore`` computes every answer. Those that neither wait nor need a clock
are in ``tf2_methods``.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
import threading
from typing import Any, NamedTuple, TypeVar

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped, Twist
from std_msgs.msg import Header
from tf_tree_py.beyond.prediction.past import ByChild
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.observers import Asked, asked, halves
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp

from .fed_buffer import FedBuffer
from .interface import BufferInterface, NO_TIME
from .tf2_methods import CoreApi
from ..messages.convert import (
    as_nanoseconds,
    as_span,
    as_stamp,
    DurationLike,
    SpanLike,
    time_message,
    TimeLike,
    transform_stamped,
)
from ..messages.geometry import twist_values
from ..messages.pose_covariances import (
    composed_with,
    pose_with_covariance_stamped,
    predicted_pose,
    PredictedPose,
)
from ..waiting.deadlines import ClockDeadline
from ..waiting.futures import TransformFuture

Answer = TypeVar('Answer')


class NewestTransform(NamedTuple):
    """
    A transform of samples with different stamps.

    :ivar transform: composed of the newest sample of each edge; its stamp is their oldest.
    :ivar stamps: those of the samples by child frame; static edges have none.
    """

    transform: TransformStamped
    stamps: dict[str, TimeMessage]


class Buffer(FedBuffer, BufferInterface):
    """
    A store of transforms with a tree of its own, which its listeners fill.

    Users have ``topics.joining_buffer.Buffer``, which can also show the tree of another process.
    """

    def lookup_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                         timeout: DurationLike = NO_TIME, *,
                         max_age: SpanLike = None) -> TransformStamped:
        """
        Return the transform that takes coordinates in source to coordinates in target.

        :param time: an rclpy ``Time``, or a message's ``header.stamp``; zero is the latest time
            for which all edges between the two have data.
        :param timeout: an rclpy ``Duration`` to wait until the lookup becomes possible.
        :param max_age: an rclpy ``Duration``: how old the latest may be by the buffer's clock.
            None: the ``max_age`` of the buffer; ``UNLIMITED``: any age. It does not concern other
            times.
        :raises LookupException: a frame that was never published.
        :raises ConnectivityException: the frames are not connected.
        :raises ExtrapolationException: an edge between them has no data for the time.
        :raises StaleException: the latest is older than ``max_age``.
        :raises InvalidArgumentException: a name that cannot be a frame, or a ``Time`` of another
            clock than that of the stamps.
        :raises TypeError: an argument is not a time or not a duration.
        """
        stamp = as_stamp(time, self._is_simulated)
        if timeout is NO_TIME and max_age is None:
            found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
        else:
            found, pose = self._within(
                timeout, [asked(target_frame, source_frame, stamp)],
                self._query(target_frame, source_frame, stamp, max_age))
        return transform_stamped(target_frame, source_frame, found, pose)

    def lookup_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                              source_time: TimeLike, fixed_frame: str,
                              timeout: DurationLike = NO_TIME) -> TransformStamped:
        """
        Return the transform from a source at one time to a target at another.

        It passes through a frame that does not move in the meantime: (target <- fixed at
        target_time) (fixed <- source at source_time). Parameters and errors are those of
        ``lookup_transform``.
        """
        stamps = self._as_stamp(target_time), self._as_stamp(source_time)
        found, pose = self._within(
            timeout, halves(target_frame, stamps[0], source_frame, stamps[1], fixed_frame),
            lambda: self.lookup_full_stamped(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame))
        return transform_stamped(target_frame, source_frame, found, pose)

    def _query(self, target_frame: str, source_frame: str, stamp: int,
               max_age: SpanLike) -> Callable[[], tuple[int, PoseTuple]]:
        """Return a lookup to be run, perhaps several times."""
        if max_age is None:
            return partial(self.lookup_stamped, target_frame, source_frame, stamp)
        limit = as_span(max_age, 'max_age')
        return partial(self.lookup_no_older, target_frame, source_frame, stamp, limit)

    def lookup_transform_newest(self, target_frame: str, source_frame: str, *,
                                timeout: DurationLike = NO_TIME,
                                max_age: SpanLike = None) -> NewestTransform:
        """
        Return the transform composed of the newest sample of each edge, whatever their stamps.

        A fast edge is not held back by a slow one, as it is at the latest common time. So this
        transform mixes times: use it if the slow edges hardly move in the meantime, as for an arm
        on a base that stands; otherwise it is one that the robot never had.

        :param timeout: an rclpy ``Duration`` to wait until the lookup becomes possible.
        :param max_age: an rclpy ``Duration``: how old the newest sample of each edge may be.

        It raises the errors of ``lookup_transform``.
        """
        limit = as_span(max_age, 'max_age')
        newest = self._within(timeout, [asked(target_frame, source_frame, LATEST)],
                              lambda: self.lookup_newest(
                                  target_frame, source_frame, max_age=limit))
        return NewestTransform(
            transform_stamped(target_frame, source_frame, newest.oldest, newest.pose),
            {child: time_message(stamp) for child, stamp in newest.stamps.items()})

    def _within(self, timeout: DurationLike, lookups: Sequence[Asked],
                query: Callable[[], Answer]) -> Answer:
        """Run a query within a timeout by the buffer's clock, and notify observers."""
        duration = as_nanoseconds(timeout)
        if duration <= 0:
            return query()
        return self.observers.watch(lookups, self._wait, duration, query)

    def _wait(self, duration: int, query: Callable[[], Answer]) -> Answer:
        deadline: ClockDeadline | None = None

        def begin(error: TransformException) -> ClockDeadline | None:
            nonlocal deadline
            if self.feeds.deliver_in(threading.current_thread()):
                error.hint = ('Did not wait: this thread delivers the transforms, so waiting '
                              'in it would only delay them')
            else:
                deadline = self.timeouts.deadline(duration)
            return deadline

        try:
            return self.waiting.wait_for(query, begin)
        except TransformException as error:
            if deadline is not None:
                deadline.explain(error)
            raise

    def lookup_uncertain(  # type: ignore[override]  # a message, as lookups of ROS return
            self, target_frame: str, source_frame: str, time: Stamp | TimeLike = LATEST,
            timeout: DurationLike = NO_TIME, *, independent: bool = False,
            learnt_noise: bool = False, max_age: SpanLike = None) -> PoseWithCovarianceStamped:
        """
        Return the pose of the source in the target, with its covariance.

        See ``Queries``. Times, timeout, ``max_age`` and errors are those of ``lookup_transform``.
        """
        stamp, limit = self._stamp_of(time), as_span(max_age, 'max_age')
        found = self._within(
            timeout, [asked(target_frame, source_frame, stamp)],
            lambda: self._lookup_uncertain(
                target_frame, source_frame, stamp, independent, learnt_noise, limit))
        return pose_with_covariance_stamped(
            target_frame, found.stamp, found.pose, found.covariance)

    def lookup_uncertain_full(  # type: ignore[override]  # likewise
            self, target_frame: str, target_time: Stamp | TimeLike, source_frame: str,
            source_time: Stamp | TimeLike, fixed_frame: str, timeout: DurationLike = NO_TIME, *,
            independent: bool = False) -> PoseWithCovarianceStamped:
        """
        Return the pose of ``lookup_transform_full``, with its covariance.

        See ``Queries``. Times, timeout and errors are those of ``lookup_transform_full``.
        """
        stamps = self._stamp_of(target_time), self._stamp_of(source_time)
        found = self._within(
            timeout, halves(target_frame, stamps[0], source_frame, stamps[1], fixed_frame),
            lambda: self._lookup_uncertain_full(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame, independent))
        return pose_with_covariance_stamped(
            target_frame, found.stamp, found.pose, found.covariance)

    def predict(  # type: ignore[override]  # likewise
            self, target_frame: str, source_frame: str, time: Stamp | TimeLike,
            horizon: DurationLike, *,
            acceleration: ByChild | None = None,
            twist: Mapping[str, Twist | Sequence[float]] | None = None) -> PredictedPose:
        """
        Return the pose of the source in the target at a time that may lie beyond the data.

        See ``Queries``.

        :param time: an rclpy ``Time``, or a message's.
        :param horizon: an rclpy ``Duration``; no edge is predicted further than that.
        :param acceleration: the largest accelerations by child frame: six numbers along x, y, z
            (m/s^2) and about x, y, z (rad/s^2), in the child's axes. Other
            edges may stop within 0.5 s.
        :param twist: the velocities that edges are known to have, by child frame, in the child's
            axes: a ``Twist``, such as that of cmd_vel, or six numbers.
        """
        return predicted_pose(target_frame, CoreApi.predict(
            self, target_frame, source_frame, self._stamp_of(time), as_nanoseconds(horizon),
            acceleration=acceleration, twist={
                child: twist_values(each) for child, each in twist.items()}
            if isinstance(twist, Mapping) else twist))

    def transform(self, object_stamped: object, target_frame: str, timeout: DurationLike = NO_TIME,
                  new_type: type | None = None, *, header: Header | None = None,
                  max_age: SpanLike = None, uncertain: bool = False) -> Any:
        """
        Return an object in another frame, at its own stamp; see ``BufferInterface``.

        :param uncertain: add the uncertainty of the edges on the path to the covariance of a
            ``PoseWithCovarianceStamped``, which is otherwise only rotated.
        :raises TypeError: ``uncertain`` with another type, with ``new_type`` or with ``header``.
        """
        if not uncertain:
            return super().transform(
                object_stamped, target_frame, timeout, new_type, header=header, max_age=max_age)
        if not isinstance(object_stamped, PoseWithCovarianceStamped) or new_type or header:
            raise TypeError('uncertain=True takes a PoseWithCovarianceStamped, and returns one; '
                            f'not {type(object_stamped).__name__}, new_type or header')
        return composed_with(self.lookup_uncertain(
            target_frame, object_stamped.header.frame_id, object_stamped.header.stamp, timeout,
            max_age=max_age), object_stamped)

    # --- futures

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: TimeLike,
                                 timeout: DurationLike | None = None, *,
                                 max_age: SpanLike = None) -> TransformFuture:
        """
        Return a future of the transform.

        Times, frames, ``max_age`` and errors are those of ``lookup_transform``. It may be called
        from any thread, including the one that delivers the transforms.

        :param timeout: an rclpy ``Duration``; None waits as long as the lookup can still succeed.
        """
        stamp = self._as_stamp(time)
        return TransformFuture(
            self.timeouts, (target_frame, source_frame),
            [asked(target_frame, source_frame, stamp)],
            self._query(target_frame, source_frame, stamp, max_age), timeout)

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str,
            timeout: DurationLike | None = None) -> TransformFuture:
        """Return a future of the transform between two times; likewise."""
        stamps = self._as_stamp(target_time), self._as_stamp(source_time)
        return TransformFuture(
            self.timeouts, (target_frame, source_frame),
            halves(target_frame, stamps[0], source_frame, stamps[1], fixed_frame),
            lambda: self.lookup_full_stamped(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame), timeout)
