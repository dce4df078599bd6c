# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What fills tf2's ``Buffer``, its clock, and what it lists; ``buffer`` adds what it answers."""

from pathlib import Path
import time

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, ClockChange, TimeJump
from rclpy.duration import Duration
import rclpy.logging
from rclpy.node import Node
from tf2_msgs.srv import FrameGraph
from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.buffer.plain_buffer import (
    DEFAULT_AUTHORITY,
    DEFAULT_MAX_FRAMES,
    DEFAULT_MAX_NAME_BYTES,
)
from tf_tree_py.core.hints import nothing_yet
from tf_tree_py.core.messages.sample import ImpossibleStamp
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST
from tf_tree_py.core.times import Stamp
from tf_tree_py.limited_log import LimitedLog
from tf_tree_py.recording.flight_recorder import FlightRecorder, Happened
from tf_tree_py.reports.audit import LookupAudit
from tf_tree_py.shared.directory import Reception
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.mirror_tree import MirrorTree

from .attached_listeners import AttachedListeners
from .interface import check_places
from .tf2_methods import CoreApi
from ..messages.convert import (
    as_moving_sample,
    as_nanoseconds,
    as_sample,
    as_span,
    nanoseconds_or_none,
    SpanLike,
    TimeLike,
)
from ..waiting.clock import ClockWatch, JUMP_BACK, RosClock
from ..waiting.timeouts import Timeouts

CLOCK_JUMP_BACK = Duration(nanoseconds=JUMP_BACK)


class FedBuffer(CoreApi):
    """A store of transforms with a tree of its own, which its listeners fill."""

    def __init__(self, cache_time: Duration | int | None = None, node: Node | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 wall_guard: Duration | None = None, audit: bool = False,
                 max_future: Duration | None = None,
                 clear_on_jump_back: Duration | None = None,
                 clear_on_clock_jump_back: Duration = CLOCK_JUMP_BACK,
                 flight_recorder: FlightRecorder | None = None,
                 max_age: SpanLike = None) -> None:
        """Make an empty buffer; the parameters are those of ``topics.joining_buffer.Buffer``."""
        if isinstance(cache_time, Node):
            raise TypeError('Buffer(cache_time, node): cache_time comes first, and here it is a '
                            f'{type(cache_time).__name__}: write Buffer(node=node)')
        check_places('Buffer(cache_time, node)', node=node)
        self._watch = ClockWatch(self.time_jump_callback, as_nanoseconds(clear_on_clock_jump_back))
        super().__init__(
            as_span(cache_time), max_frames=max_frames,
            max_name_bytes=max_name_bytes, now=self.now,
            max_future=nanoseconds_or_none(max_future),
            clear_on_jump_back=nanoseconds_or_none(clear_on_jump_back),
            max_age=as_span(max_age, 'max_age'))
        self._watch.on_younger = self.waiting.ask_again
        self.timeouts = Timeouts(
            self.waiting, self._watch,
            None if wall_guard is None else as_nanoseconds(wall_guard) / 1e9, self.observers)
        self.feeds = AttachedListeners(self.intake, self.waiting, self._watch,
                                       rclpy.logging.get_logger('tf_tree_py'))
        """The listeners that fill this buffer; they register themselves here."""
        self._tree.paths.when_empty = self._when_empty
        self.timeouts.check_spinning = self.feeds.check_spinning
        if node is not None:
            self.feeds.log_to(node.get_logger())
            self._watch.use_clock(RosClock(node.get_clock(), node.context))
            self.srv = node.create_service(FrameGraph, 'tf2_frames', self._serve_frames)
        self.audit = LookupAudit(self, self.now) if audit else None
        if self.audit is not None:
            self.observers.add(self.audit)
        if flight_recorder is not None:
            flight_recorder.notify = flight_recorder.notify or _log_recording
            self.observers.add(flight_recorder)

    # --- another process

    @property
    def is_shared(self) -> bool:
        """Return whether it shows the tree of another process, which ``tf_share`` shares."""
        return isinstance(self._tree, MirrorTree)

    def check_receives(self, reader: str) -> None:
        """
        Check that this buffer has a tree of its own.

        :param reader: what needs that, such as ``GyroListener(buffer, node, child)``.
        :raises SharedTreeException: it shows that of another process.
        """
        if self.is_shared:
            raise SharedTreeException(
                f'{reader}: this buffer shows the tree of another process, which shares '
                'transforms alone: make one with Buffer(shared=False)')

    def join(self, node: Node, reception: Reception) -> bool:
        """
        Return whether a listener need not subscribe, because this buffer is filled anyway.

        A listener calls this before it subscribes. In this class it always has to.

        :param node: the node of the listener.
        :param reception: the options of the listener.
        """
        return False

    def rejoin(self, reception: Reception) -> None:
        """Take note that the options of a listener have changed that did not subscribe."""

    def now(self) -> int:
        """Return the time of the clock that the stamps follow, nanoseconds."""
        simulated = self._watch.simulated_now()
        return time.time_ns() if simulated is None else simulated

    # --- feeding

    def set_transform(self, transform: TransformStamped,
                      authority: str = DEFAULT_AUTHORITY) -> bool:
        """
        Insert a moving transform.

        :return: whether it was accepted; if not, the log and ``statistics()`` have the reason.
        """
        sample = as_moving_sample(transform)
        if isinstance(sample, ImpossibleStamp):
            self.feeds.refuse(sample.incident(authority))
            return False
        return self.feeds.note(self.intake.insert([sample], authority, False))

    def set_transform_static(self, transform: TransformStamped,
                             authority: str = DEFAULT_AUTHORITY) -> bool:
        """
        Insert a transform that is valid at all times.

        :return: whether it was accepted; if not, the log and ``statistics()`` have the reason.
        """
        return self.feeds.note(self.intake.insert([as_sample(transform)], authority, True))

    def _when_empty(self) -> str:
        """Return the hint for lookups while there is no frame; the lock is held."""
        if self.is_shared:
            return f'{nothing_yet()} by tf_share: does any node publish on its topics?'
        counts = self.intake.statistics()
        if counts.accepted:
            return 'All frames were removed'
        if counts.refused:
            return 'All that was received was refused: the log and statistics() have the reasons'
        return self._nothing_yet()

    def _nothing_yet(self) -> str:
        if len(self.feeds):
            *topics, last = self.feeds.topics or ['/tf']
            where = f'{", ".join(topics)} or {last}' if topics else last
            return (f'{nothing_yet()}: does any node publish on {where} with the same '
                    'ROS_DOMAIN_ID? tf_doctor also reports publishers whose quality of service '
                    'does not match')
        if self.feeds.side_listeners:  # covariances may have arrived
            return ('No transform has been received yet, and no listener of this buffer reads '
                    '/tf: TransformListener(buffer, node) does')
        return (f'{nothing_yet()}, and no listener feeds this buffer: '
                'TransformListener(buffer, node) does')

    # --- clock

    def use_clock(self, clock: Clock) -> None:
        """Follow a clock from now on: for timeouts, and to forget samples when it jumps back."""
        self._watch.use_clock(RosClock(clock))
        self.intake.read_clock_anew()

    def _is_simulated(self) -> bool:
        return self._watch.simulated

    @property
    def clock(self) -> Clock:
        """Return the clock that the buffer follows; the system's if none was lent."""
        return self._watch.clock or Clock()

    def time_jump_callback(self, time_jump: TimeJump) -> None:
        """Forget moving transforms, because the clock jumped back or was replaced, and log it."""
        if self.is_shared:
            return  # its process has the same clock: it forgets them, fails all waits, and logs it
        why = _why_anew(time_jump, self.now())
        self.start_anew(why)
        # In tf2's words first, for those who search for them.
        self.feeds.log.write('jump back in time', '', (
            f'Detected jump back in time: {why}. The buffer forgot all moving transforms'), None)

    # --- listing

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        return self._with_names(super().edges())

    def edges_between(self, target_frame: str, source_frame: str,
                      stamp: Stamp | TimeLike = LATEST) -> list[EdgeInfo]:
        """
        Return the edges from the source up to the common ancestor and down to the target.

        See ``BufferCore.edges_between``.
        """
        return self._with_names(
            super().edges_between(target_frame, source_frame, self._stamp_of(stamp)))

    def _with_names(self, edges: list[EdgeInfo]) -> list[EdgeInfo]:
        names = self.feeds.names()
        return [edge._replace(authority=names.get(edge.authority, edge.authority))
                for edge in edges]

    def _serve_frames(self, _: FrameGraph.Request,
                      response: FrameGraph.Response) -> FrameGraph.Response:
        try:
            response.frame_yaml = self.all_frames_as_yaml()
        except SharedTreeException as error:  # it would end the executor
            response.frame_yaml = f'# {error}\n'
        return response


_recordings = LimitedLog(lambda line: rclpy.logging.get_logger('tf_tree_py').warning(line))


def _log_recording(happened: Happened, path: Path | None, why_not: str) -> None:
    what = f'recorded as {path}' if path else f'not recorded: {why_not}'
    _recordings.write('recorded' if path else 'not recorded', '', f'{happened.summary} ({what})',
                      None if path else '')


def _why_anew(jump: TimeJump, now: int) -> str:
    """Return why time starts anew, as a clause."""
    clock = {ClockChange.ROS_TIME_ACTIVATED: 'simulated', ClockChange.ROS_TIME_DEACTIVATED:
             "the system's"}.get(jump.clock_change)
    if clock is not None:
        return f'use_sim_time was switched, and the clock is {clock} now'
    back = -jump.delta.nanoseconds
    return (f'the clock went back by {format_span(back)}, from {format_stamp(now + back)} '
            f'to {format_stamp(now)}')
