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

"""
tf2's ``Buffer``: the core with messages, clocks and timeouts.

Only translation happens here; every answer is ``BufferCore``'s. What neither
waits nor needs a clock is in ``tf2_methods``.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
import threading
import time
from typing import Any, TypeVar

from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.clock import Clock, TimeJump
from rclpy.duration import Duration
import rclpy.logging
from rclpy.node import Node
from std_msgs.msg import Header
from tf2_msgs.srv import FrameGraph
from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.arrivals.observers import Asked, asked, halves
from tf_tree_py.core.buffer.buffer_core import (
    DEFAULT_AUTHORITY,
    DEFAULT_MAX_FRAMES,
    DEFAULT_MAX_NAME_BYTES,
)
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.flight_recorder import FlightRecorder, Happened
from tf_tree_py.core.stamp import LATEST, UNLIMITED
from tf_tree_py.core.telling.audit import LookupAudit

from .feeds import Feeds
from .interface import BufferInterface, NO_TIME
from .tf2_methods import CoreApi
from .wrong_arguments import check_places
from ..messages.convert import as_nanoseconds, as_sample, as_stamp, transform_stamped
from ..messages.uncertain import (
    composed_with,
    pose_with_covariance_stamped,
    predicted_pose,
    PredictedPose,
)
from ..waiting.clock import ClockWatch
from ..waiting.futures import TransformFuture
from ..waiting.timeouts import Timeouts

Answer = TypeVar('Answer')


class Buffer(CoreApi, BufferInterface):
    """
    Stores transforms and answers where one frame is in another, at a time.

    Everything that tf2's buffer has, and what ``BufferCore`` adds. With a node it
    serves ``tf2_frames`` and goes by the node's clock; a ``TransformListener``
    lends it its own, which ticks even while the node's callbacks block. When the
    clock jumps back, what moves is forgotten and everybody who waits is told.
    """

    def __init__(self, cache_time: Duration | int | None = None, node: Node | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 wall_guard: Duration | None = None, audit: bool = False,
                 max_future: Duration | None = None,
                 clear_on_jump_back: Duration | None = None,
                 flight_recorder: FlightRecorder | None = None) -> None:
        """
        Make an empty buffer.

        :param cache_time: how much history each edge keeps; 10 s unless given, and with
            ``UNLIMITED`` everything.
        :param node: serves ``tf2_frames``, logs, and lends its clock.
        :param max_frames: how many frame names are let in, against a hostile publisher.
        :param max_name_bytes: how long a frame name may be in UTF-8, likewise.
        :param wall_guard: with simulated time, the longest that a lookup may wait by
            the wall, should ``/clock`` stand still; None: as long as it does.
        :param audit: watch what lookups ask for; ``self.audit`` tells, else it is None.
        :param max_future: how far ahead of the buffer's clock a stamp may be; what is
            further is refused. None: it is taken, and told from 10 s on.
        :param clear_on_jump_back: forget what moves when stamps jump back by more than
            that, as those of a bag that is played in a loop without ``/clock`` do: more
            than any publisher is late, less than the bag is long. None: refuse them.
        :param flight_recorder: keeps what listeners hear, and writes it as a bag on the first
            lookup that fails after it had worked.
        """
        if isinstance(cache_time, Node):
            raise TypeError('Buffer(cache_time, node): cache_time comes first, and here it is a '
                            f'{type(cache_time).__name__}: write Buffer(node=node)')
        check_places('Buffer(cache_time, node)', node=node)
        self._watch = ClockWatch(self.time_jump_callback)
        super().__init__(
            _cache_time(cache_time), max_frames=max_frames,
            max_name_bytes=max_name_bytes, now=self.now,
            max_future=_nanoseconds_or_none(max_future),
            clear_on_jump_back=_nanoseconds_or_none(clear_on_jump_back))
        self.timeouts = Timeouts(
            self.waiting, self._watch,
            None if wall_guard is None else as_nanoseconds(wall_guard) / 1e9, self.observers)
        self.feeds = Feeds(self.intake, self.waiting, self._watch, self._say_when_empty,
                           rclpy.logging.get_logger('tf_tree_py'))
        """All who fill this buffer; listeners enter themselves here."""
        if node is not None:
            self.feeds.log_to(node.get_logger())
            self._watch.use_clock(node.get_clock(), node.context)
            self.srv = node.create_service(FrameGraph, 'tf2_frames', self._serve_frames)
        self.audit = LookupAudit(self, self.now) if audit else None
        if self.audit is not None:
            self.observers.add(self.audit)
        if flight_recorder is not None:
            flight_recorder.notify = flight_recorder.notify or _log_recording
            self.observers.add(flight_recorder)

    def now(self) -> int:
        """Return the time by the clock that stamps go by, nanoseconds."""
        simulated = self._watch.simulated_now()
        return time.time_ns() if simulated is None else simulated

    # --- feeding

    def set_transform(self, transform: TransformStamped,
                      authority: str = DEFAULT_AUTHORITY) -> bool:
        """
        Take a transform that moves.

        :return: whether it was taken; if not, the log and ``statistics()`` say why.
        """
        return self.feeds.note(self.intake.take([as_sample(transform)], authority, False))

    def set_transform_static(self, transform: TransformStamped,
                             authority: str = DEFAULT_AUTHORITY) -> bool:
        """
        Take a transform that is valid at all times.

        :return: whether it was taken; if not, the log and ``statistics()`` say why.
        """
        return self.feeds.note(self.insert_many(
            [as_sample(transform)], authority, static=True, strict=False))

    def _say_when_empty(self, fed: bool) -> None:
        self._tree.ways.when_empty = self._when_empty(fed)

    def _when_empty(self, fed: bool) -> str:
        """Return the hint for lookups before anything has come."""
        if fed:
            return ('Nothing has been received yet: does anybody publish on /tf or /tf_static, '
                    'with the same ROS_DOMAIN_ID? tf_doctor also tells of publishers whose '
                    'quality of service does not match')
        return ('Nothing has been received yet, and no listener feeds this buffer: '
                'TransformListener(buffer, node) does')

    # --- clock

    def use_clock(self, clock: Clock) -> None:
        """Go by a clock from now on: for timeouts, and to forget when it jumps back."""
        self._watch.use_clock(clock)
        self.intake.read_clock_anew()

    def _is_simulated(self) -> bool:
        return self._watch.simulated

    @property
    def clock(self) -> Clock:
        """Return the clock that the buffer goes by, the system's if nobody lent one."""
        return self._watch.clock or Clock()

    def time_jump_callback(self, time_jump: TimeJump) -> None:
        """Forget what moves, for the clock jumped back; called by rclpy."""
        self.start_anew(
            f'The clock jumped by {time_jump.delta.nanoseconds / 1e9:.3f} s, or changed its '
            'source,')

    # --- asking

    def lookup_transform(self, target_frame: str, source_frame: str, time: Any,
                         timeout: Any = NO_TIME) -> TransformStamped:
        """
        Return the transform that takes coordinates in source to coordinates in target.

        :param time: an rclpy ``Time``, or a message's ``header.stamp``; zero is the
            latest time for which all edges between the two have data.
        :param timeout: an rclpy ``Duration`` to wait for it to become possible.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        :raises ExtrapolationException: an edge between them has no data for the time.
        :raises InvalidArgumentException: a name that cannot be a frame, or a ``Time`` of
            another clock than that of the stamps.
        """
        stamp = as_stamp(time, self._is_simulated)

        if timeout is NO_TIME:
            found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
        else:
            found, pose = self._within(
                timeout, [asked(target_frame, source_frame, stamp)],
                lambda: self.lookup_stamped(target_frame, source_frame, stamp))
        return transform_stamped(target_frame, source_frame, found, pose)

    def lookup_transform_full(self, target_frame: str, target_time: Any, source_frame: str,
                              source_time: Any, fixed_frame: str,
                              timeout: Any = NO_TIME) -> TransformStamped:
        """
        Return the transform from a source at one time to a target at another.

        Through a frame that stays put meanwhile: (target <- fixed at target_time)
        (fixed <- source at source_time). Parameters and errors as ``lookup_transform``.
        """
        stamps = self._as_stamp(target_time), self._as_stamp(source_time)
        found, pose = self._within(
            timeout, halves(target_frame, stamps[0], source_frame, stamps[1], fixed_frame),
            lambda: self.lookup_full_stamped(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame))
        return transform_stamped(target_frame, source_frame, found, pose)

    def _within(self, timeout: Any, lookups: Sequence[Asked],
                query: Callable[[], Answer]) -> Answer:
        """Answer a query within a timeout by the buffer's clock; observers are told."""
        duration = as_nanoseconds(timeout)
        if duration <= 0:
            return query()
        if self.observers.hear_lookups():
            return self.observers.watch(lookups, self._wait, duration, query)
        return self._wait(duration, query)

    def _wait(self, duration: int, query: Callable[[], Answer]) -> Answer:
        try:
            return query()
        except TransformException as error:
            if error.blocked_on is None:
                raise
            if self.feeds.deliver_in(threading.current_thread()):
                error.hint = ('Not waited: this very thread delivers the transforms, so waiting '
                              'in it would only delay them')
                raise
        deadline = self.timeouts.deadline(duration)
        try:
            return self.wait_for(query, deadline)
        except TransformException as error:
            error.hint = deadline.why_early or error.hint
            raise

    def lookup_uncertain(  # type: ignore[override]  # a message, as lookups of ROS return
            self, target_frame: str, source_frame: str, time: Any = LATEST,
            timeout: Any = NO_TIME, *, independent: bool = False) -> PoseWithCovarianceStamped:
        """
        Return the pose of the source in the target, with its covariance.

        See ``Queries``. Times, timeout and errors are those of ``lookup_transform``.
        """
        stamp = self._stamp_of(time)
        found = self._within(
            timeout, [asked(target_frame, source_frame, stamp)],
            lambda: self._lookup_uncertain(target_frame, source_frame, stamp, independent))
        return pose_with_covariance_stamped(
            target_frame, found.stamp, found.pose, found.covariance)

    def predict(  # type: ignore[override]  # likewise
            self, target_frame: str, source_frame: str, time: Any,
            horizon: Any) -> PredictedPose:
        """
        Return the pose of the source in the target at a time that may lie beyond the data.

        See ``Queries``.

        :param time: an rclpy ``Time``, or a message's.
        :param horizon: an rclpy ``Duration``; no edge is taken further.
        """
        return predicted_pose(target_frame, CoreApi.predict(
            self, target_frame, source_frame, self._stamp_of(time), as_nanoseconds(horizon)))

    def transform(self, object_stamped: Any, target_frame: str, timeout: Any = NO_TIME,
                  new_type: type | None = None, *, header: Header | None = None,
                  uncertain: bool = False) -> Any:
        """
        Return an object in another frame, at its own stamp; see ``BufferInterface``.

        :param uncertain: add what the edges on the way may be off to the covariance of a
            ``PoseWithCovarianceStamped``, which else is only turned.
        :raises TypeError: ``uncertain``, and an object of another type or for another one.
        """
        if not uncertain:
            return super().transform(
                object_stamped, target_frame, timeout, new_type, header=header)
        if not isinstance(object_stamped, PoseWithCovarianceStamped) or new_type or header:
            raise TypeError('uncertain=True takes a PoseWithCovarianceStamped, and returns one; '
                            f'not {type(object_stamped).__name__}, new_type or header')
        return composed_with(self.lookup_uncertain(
            target_frame, object_stamped.header.frame_id, object_stamped.header.stamp, timeout),
            object_stamped)

    # --- asking for later

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any,
                                 timeout: Any = None) -> TransformFuture:
        """
        Return a future of the transform.

        Times, frames and errors are those of ``lookup_transform``, and it may be called
        from any thread, also from the one that delivers the transforms.

        :param timeout: an rclpy ``Duration``; None waits as long as there is hope.
        """
        stamp = self._as_stamp(time)
        return TransformFuture(
            self.timeouts, (target_frame, source_frame),
            [asked(target_frame, source_frame, stamp)],
            lambda: self.lookup_stamped(target_frame, source_frame, stamp), timeout)

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = None) -> TransformFuture:
        """Return a future of the transform between two times; likewise."""
        stamps = self._as_stamp(target_time), self._as_stamp(source_time)
        return TransformFuture(
            self.timeouts, (target_frame, source_frame),
            halves(target_frame, stamps[0], source_frame, stamps[1], fixed_frame),
            lambda: self.lookup_full_stamped(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame), timeout)

    # --- listing

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        return self._with_names(super().edges())

    def edges_between(self, target_frame: str, source_frame: str,
                      stamp: Any = LATEST) -> list[EdgeInfo]:
        """
        Return the edges from the source up to the common ancestor and down to the target.

        See ``BufferCore.edges_between``.
        """
        return self._with_names(super().edges_between(target_frame, source_frame, stamp))

    def _with_names(self, edges: list[EdgeInfo]) -> list[EdgeInfo]:
        names = self.feeds.names()
        return [edge._replace(authority=names.get(edge.authority, edge.authority))
                for edge in edges]

    def _serve_frames(self, _: FrameGraph.Request,
                      response: FrameGraph.Response) -> FrameGraph.Response:
        response.frame_yaml = self.all_frames_as_yaml()
        return response


def _log_recording(happened: Happened, path: Path | None, why_not: str) -> None:
    what = f'recorded as {path}' if path else f'not recorded: {why_not}'
    rclpy.logging.get_logger('tf_tree_py').warning(f'{happened.summary} ({what})')


def _cache_time(given: Duration | int | None) -> int | None:
    return UNLIMITED if given == UNLIMITED else _nanoseconds_or_none(given)


def _nanoseconds_or_none(duration: Duration | int | None) -> int | None:
    return None if duration is None else as_nanoseconds(duration)
