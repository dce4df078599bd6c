"""
tf2's ``Buffer``: the core with messages, clocks and timeouts.

Only translation happens here; every answer is ``BufferCore``'s. What neither
waits nor needs a clock is in ``core_api``.
"""

from collections.abc import Callable
import threading
import time
from typing import Any, Protocol, TypeVar
import weakref

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, TimeJump
from rclpy.context import Context
from rclpy.duration import Duration
import rclpy.logging
from rclpy.node import Node
from tf2_msgs.srv import FrameGraph
from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.buffer.buffer_core import (
    DEFAULT_AUTHORITY,
    DEFAULT_MAX_FRAMES,
    DEFAULT_MAX_NAME_BYTES,
)
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import UNLIMITED
from tf_tree_py.core.telling.audit import LookupAudit

from .incident_log import IncidentLog
from .interface import BufferInterface, NO_TIME
from .tf2_methods import CoreApi
from .twists import TwistLookups
from .wrong_arguments import check_places
from ..messages.convert import as_nanoseconds, as_sample, as_stamp, transform_stamped
from ..waiting.clock import ClockDeadline, ClockWatch
from ..waiting.futures import AsyncLookups

Answer = TypeVar('Answer')


class Authority(Protocol):
    """Who publishes on a topic: a name that may be known later."""

    placeholder: str

    def name(self) -> str:
        """Return the name as it is now."""


class Buffer(AsyncLookups, TwistLookups, CoreApi, BufferInterface):
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
                 clear_on_jump_back: Duration | None = None) -> None:
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
        self._wall_guard_s = None if wall_guard is None else as_nanoseconds(wall_guard) / 1e9
        self._feeds = 0
        self._tree.when_empty = self._when_empty()
        # Not their identifiers: those are given to other threads later.
        self._feeding_threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
        self._authorities: dict[str, Authority] = {}
        self._log_to(rclpy.logging.get_logger('tf_tree_py'))
        if node is not None:
            self._log_to(node.get_logger())
            self._watch.follow(node.get_clock(), node.context)
            self.srv = node.create_service(FrameGraph, 'tf2_frames', self._serve_frames)
        self.audit = LookupAudit(self, self.now) if audit else None
        if self.audit is not None:
            # On this object only: a buffer without an audit pays nothing for it.
            self.lookup = self.audit.watch(self.lookup, self._stamp_of)
            self.lookup_transform = self.audit.watch(self.lookup_transform, as_nanoseconds)

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
        sample = as_sample(transform)
        return self._note(self._insert([sample], [sample.stamp], authority, False))

    def set_transform_static(self, transform: TransformStamped,
                             authority: str = DEFAULT_AUTHORITY) -> bool:
        """
        Take a transform that is valid at all times.

        :return: whether it was taken; if not, the log and ``statistics()`` say why.
        """
        return self._note(self.insert_many([as_sample(transform)], authority, static=True,
                                           strict=False))

    def _note(self, incidents: list[Incident]) -> bool:
        """Log what was odd about an insertion; return whether all of it was taken."""
        if not incidents:
            return True
        self._incident_log.report(incidents)
        return not any(incident.refused for incident in incidents)

    def _refuse(self, incident: Incident) -> None:
        """Count and log what does not come from inserting: what is no transform, say."""
        self._record(incident)
        self._incident_log.report([incident])

    def _begin_feed(self, clock: Clock, context: Context) -> None:
        """Go by the clock of a listener, as long as it delivers transforms."""
        with self._lock:
            self._feeds += 1
            self._tree.when_empty = self._when_empty()
        self._watch.follow(clock, context)
        self._read_clock_anew()

    def _end_feed(self, clock: Clock, context: Context) -> None:
        """Let a listener go; after the last one nobody waits any longer."""
        self._watch.leave(clock, context)
        self._read_clock_anew()
        with self._lock:
            self._feeds -= 1
            self._tree.when_empty = self._when_empty()
            deserted = self._feeds == 0
        if deserted:
            self._watch.release()
            self._wake_everybody()

    def _when_empty(self) -> str:
        """Return the hint for who asks before anything has come."""
        if self._feeds:
            return ('Nothing has been received yet: does anybody publish on /tf or /tf_static, '
                    'with the same ROS_DOMAIN_ID?')
        return ('Nothing has been received yet, and no listener feeds this buffer: '
                'TransformListener(buffer, node) does')

    def _fed_by(self, thread: threading.Thread) -> None:
        """Note a thread that delivers transforms, and therefore must not wait for them."""
        self._feeding_threads.add(thread)

    def _no_longer_fed_by(self, thread: threading.Thread) -> None:
        """Let a thread wait again that delivered transforms."""
        self._feeding_threads.discard(thread)

    def _name_later(self, authority: Authority) -> None:
        """Ask an authority for the name that it did not know yet, when it is wanted."""
        self._authorities[authority.placeholder] = authority

    def _log_to(self, logger: Any) -> None:
        """Write what is odd about arriving transforms to an rclpy logger."""
        self._incident_log = IncidentLog(logger)

    # --- clock

    def use_clock(self, clock: Clock) -> None:
        """Go by a clock from now on: for timeouts, and to forget when it jumps back."""
        self._watch.follow(clock)
        self._read_clock_anew()

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
                timeout, lambda: self.lookup_stamped(target_frame, source_frame, stamp))
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
        found, pose = self._within(timeout, lambda: self.lookup_full_stamped(
            target_frame, stamps[0], source_frame, stamps[1], fixed_frame))
        return transform_stamped(target_frame, source_frame, found, pose)

    def _within(self, timeout: Any, query: Callable[[], Answer]) -> Answer:
        """Answer a query within a timeout by the buffer's clock."""
        duration = as_nanoseconds(timeout)
        if duration <= 0:
            return query()
        try:
            return query()
        except TransformException as error:
            if error.blocked_on is None:
                raise
            if threading.current_thread() in self._feeding_threads:
                error.hint = ('Not waited: this very thread delivers the transforms, so waiting '
                              'in it would only delay them')
                raise
        deadline = ClockDeadline(self._watch, duration, self._wall_guard_s)
        try:
            return self.wait_for(query, deadline)
        except TransformException as error:
            error.hint = deadline.why_early or error.hint
            raise

    # --- listing

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        edges = super().edges()
        names = {placeholder: authority.name()
                 for placeholder, authority in self._authorities.items()}
        return [edge._replace(authority=names.get(edge.authority, edge.authority))
                for edge in edges]

    def _serve_frames(self, _: FrameGraph.Request,
                      response: FrameGraph.Response) -> FrameGraph.Response:
        response.frame_yaml = self.all_frames_as_yaml()
        return response


def _cache_time(given: Duration | int | None) -> int | None:
    return UNLIMITED if given == UNLIMITED else _nanoseconds_or_none(given)


def _nanoseconds_or_none(duration: Duration | int | None) -> int | None:
    return None if duration is None else as_nanoseconds(duration)
