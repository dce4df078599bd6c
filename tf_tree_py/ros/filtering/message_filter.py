# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A filter that holds messages until they can be transformed, then calls back with both.

It counts the messages that it drops, by reason, and warns if it drops all.
"""

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import await_or_execute
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.time import Time
from std_msgs.msg import Header
from tf_tree_py.core import fork_locks
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.errors import (
    ClockJumpException,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import LATEST

from .losses import Arrival, Losses
from ..buffer.buffer import Buffer
from ..buffer.interface import check_is_ours, check_places, NO_TIME
from ..messages.convert import as_nanoseconds, DurationLike, transform_stamped
from ..topics.qos import sensor_qos
from ..waiting.timeouts import Wait


class Drop(Enum):
    """The reason for which a message was dropped."""

    EMPTY_FRAME = 'its frame_id is empty'
    IMPOSSIBLE_FRAME = 'its frame_id cannot be the name of a frame'
    TOO_OLD = 'its stamp is older than the buffer keeps'
    QUEUE_FULL = 'newer messages replaced it in the queue'
    UNKNOWN_FRAME = 'one of the frames was not published within the timeout'
    NOT_CONNECTED = 'the frames were not connected within the timeout'
    NO_DATA = 'there was no data for its stamp within the timeout'
    CLOCK_JUMPED = 'the clock jumped back'
    CLOSED = 'the filter was closed, or the last listener of its buffer'


# A message that was dropped for one of these could never have its transforms.
_NEVER = (Drop.EMPTY_FRAME, Drop.IMPOSSIBLE_FRAME, Drop.TOO_OLD)
# These concern all messages that wait, whatever their transforms.
_FOR_ALL = (Drop.CLOCK_JUMPED, Drop.CLOSED)


@dataclass(frozen=True)
class FilterStatistics:
    """
    Counts since a filter was made: received = delivered + all dropped + held.

    :ivar held: messages that wait at the moment, for a transform or for the executor.
    """

    received: int
    delivered: int
    dropped: dict[Drop, int]
    held: int


def _drop_for(error: TransformException, *, released: bool) -> Drop:
    """
    Return the reason for dropping a message whose lookup failed with an error.

    :param released: whether the last listener of the buffer has closed.
    """
    if isinstance(error, ClockJumpException):
        return Drop.CLOCK_JUMPED
    if isinstance(error, InvalidArgumentException):
        return Drop.IMPOSSIBLE_FRAME
    if released:
        return Drop.CLOSED
    if isinstance(error, LookupException):
        return Drop.UNKNOWN_FRAME
    if isinstance(error, ConnectivityException):
        return Drop.NOT_CONNECTED
    if isinstance(error, ExtrapolationException):
        return Drop.TOO_OLD if error.blocked_on is None else Drop.NO_DATA
    return Drop.CLOSED


# --- the filter

# For each target frame its name, the stamp that was found, and target_T_frame.
_Answer = list[tuple[str, int, PoseTuple]]


class MessageFilter(Closable):
    """
    Calls back with a message and its transform, once the transform is available.

    The callback receives the transform, so that it need not look it up again; it could be
    gone by then. Each message is either passed to the callback once, or dropped. Drops are
    counted by reason, and passed to ``on_drop``.

    If it drops many messages of a topic and passes none in ten seconds, it logs one warning, with
    the cause and the option that would help.

    Callbacks run in the node's executor, as those of a subscription. Messages of one frame are
    delivered in the order in which they were added, except that a message without a transform
    does not delay later ones. Messages of different frames are delivered as their transforms
    become available.

    All methods may be called from any thread. A filter lives as long as its node or
    until ``close()``; it is a context manager.
    """

    def __init__(self, buffer: Buffer, node: Node, target_frames: str | Sequence[str],
                 callback: Callable[[Any, Any], object], *, queue_size: int = 10,
                 tolerance: DurationLike = NO_TIME, timeout: DurationLike | None = None,
                 on_drop: Callable[[Any, Drop, str], None] | None = None,
                 header_of: Callable[[Any], Header] | None = None,
                 callback_group: CallbackGroup | None = None) -> None:
        """
        Begin with an empty queue; ``add``, ``subscribe`` and ``connect`` fill it.

        :param node: the node whose executor runs the callbacks.
        :param target_frames: one frame, or several that must all be reachable.
        :param callback: receives a message and its ``TransformStamped``; with several
            targets, a dict of them by target frame. It may be a coroutine function.
        :param queue_size: how many messages may wait for their transforms, and how many
            for the executor; beyond that the oldest is dropped. 0: without a limit.
        :param tolerance: an rclpy ``Duration``; there must also be transforms for a time
            that much later than the message's.
        :param timeout: how long a message may wait for its transforms, by the buffer's
            clock; None: until the queue is full.
        :param on_drop: receives a dropped message, the reason, and a sentence. It runs in the
            executor as ``callback`` does; ``close``, and ``add`` after it, call it directly.
        :param header_of: returns the header of a message without a field ``header``.
        :param callback_group: the node's default group unless given.
        :raises TypeError: a buffer of another library, such as tf2's.
        """
        check_is_ours(buffer, Buffer, 'MessageFilter')
        check_places('MessageFilter(buffer, node, target_frames, callback)', node=node)
        self._several = not isinstance(target_frames, str)
        targets = [target_frames] if isinstance(target_frames, str) else target_frames
        self._targets = [target.removeprefix('/') for target in targets]
        if not self._targets or '' in self._targets:
            raise ValueError(f'target_frames are {target_frames!r}: name at least one, none empty')
        if queue_size < 0:
            raise ValueError(f'queue_size is {queue_size}, and cannot be negative')
        self._buffer = buffer
        self._node = node
        self._callback = callback
        self._queue_size = queue_size
        self._tolerance = as_nanoseconds(tolerance)
        self._timeout = None if timeout is None else as_nanoseconds(timeout)
        self._on_drop = on_drop
        self._header_of = header_of
        self._group = callback_group
        self._subscriptions: list[Subscription] = []
        # Taken before the buffer's lock, never after it.
        self._lock = fork_locks.rlock()
        self._closed = False
        self._received = self._delivered = 0
        self._dropped = dict.fromkeys(Drop, 0)
        self._waiting: dict[int, _Held] = {}
        self._ready: dict[int, _Held] = {}
        self._notices: deque[tuple[object, Drop, str]] = deque()
        self._losses = Losses(node, buffer.timeouts, self._lock, self._query, self._targets,
                              queue_size, self._timeout, self._tolerance)
        self._bell = node.create_guard_condition(self._call_back, callback_group)

    # --- filling

    def add(self, message: object) -> None:
        """Add a message; this may be the callback of a subscription."""
        self._add(message, '')

    def _add(self, message: Any, topic: str) -> None:
        header = message.header if self._header_of is None else self._header_of(message)
        frame, stamp = header.frame_id.removeprefix('/'), as_nanoseconds(header.stamp, Time)
        with self._lock:
            number = self._received = self._received + 1
            held = _Held(self, message, self._losses.arrived(topic, frame, stamp, number))
            if self._closed:
                self._drop(held, Drop.CLOSED)
            elif not frame:
                self._drop(held, Drop.EMPTY_FRAME)
            else:
                self._waiting[number] = held
                held.wait.ask()
                self._make_room(self._waiting)
        if self._closed:
            self._report_drops()

    def subscribe(self, msg_type: type, topic: str,
                  qos: QoSProfile | int | None = None) -> Subscription:
        """
        Add every message of a topic; the subscription ends with the filter.

        :param qos: best effort, volatile and depth 10 unless given, which matches every
            publisher. A reliable subscription receives nothing from best-effort sensors. An
            int is the depth of a reliable subscription, as in rclpy.
        """
        subscription = self._node.create_subscription(
            msg_type, topic, partial(self._add, topic=topic),
            sensor_qos() if qos is None else qos, callback_group=self._group)
        self._losses.names[topic] = subscription.topic_name
        self._subscriptions.append(subscription)
        return subscription

    def connect(self, source: Any) -> None:
        """Add every message of a ``message_filters`` filter, such as its ``Subscriber``."""
        source.registerCallback(self.add)

    def statistics(self) -> FilterStatistics:
        """Return the counts, all taken at the same moment."""
        with self._lock:
            return FilterStatistics(self._received, self._delivered, dict(self._dropped),
                                    len(self._waiting) + len(self._ready))

    def close(self) -> None:
        """Drop all messages that are held, and all that are added later."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            for held in [*self._waiting.values(), *self._ready.values()]:
                self._drop(held, Drop.CLOSED)
            self._losses.close()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._node.destroy_guard_condition(self._bell)
        self._report_drops()

    # --- with the lock

    def _query(self, frame: str, stamp: int) -> _Answer:
        answer = [(target, *self._buffer.lookup_stamped(target, frame, stamp))
                  for target in self._targets]
        if self._tolerance > 0 and stamp != LATEST:
            for target in self._targets:
                self._buffer.lookup_stamped(target, frame, stamp + self._tolerance)
        return answer

    def _found(self, held: '_Held') -> None:
        """Mark a message as ready, now that its transforms are available."""
        # The same transform may have completed an earlier message, too, whose thread has not
        # run its query again yet. That message has to be delivered first.
        for earlier in list(self._waiting.values()):
            if earlier.number >= held.number:
                break
            if earlier.frame == held.frame and earlier.wait.is_being_woken:
                earlier.wait.ask()
        del self._waiting[held.number]
        self._ready[held.number] = held
        self._losses.passed(held.arrival)
        self._make_room(self._ready)
        self._ring()

    def _make_room(self, queue: dict[int, '_Held']) -> None:
        if 0 < self._queue_size < len(queue):
            self._drop(next(iter(queue.values())), Drop.QUEUE_FULL)

    def _drop(self, held: '_Held', drop: Drop, why: str = '') -> None:
        held.wait.end()
        self._waiting.pop(held.number, None)
        was_ready = self._ready.pop(held.number, None) is not None
        self._dropped[drop] += 1
        if was_ready:
            if not self._delivered and not self._closed:
                self._losses.not_called(held.arrival)
        elif drop in _NEVER:
            self._losses.dropped(held.arrival, drop.name, why or drop.value)
        elif drop not in _FOR_ALL:
            self._losses.dropped(held.arrival)
        if self._on_drop is not None:
            self._notices.append((held.message, drop, why or drop.value))
            self._ring()

    def _ring(self) -> None:
        with suppress(InvalidHandle):  # the node is gone, or the filter closed
            self._bell.trigger()

    # --- calling back, without the lock

    async def _call_back(self) -> None:
        ready = len(self._ready)
        try:
            self._report_drops()
            for _ in range(ready):
                held = self._pop_ready()
                if held is not None:
                    await await_or_execute(self._callback, held.message, self._transforms(held))
        finally:
            if self._ready or self._notices:
                self._ring()

    def _report_drops(self) -> None:
        for _ in range(len(self._notices)):
            try:
                notice = self._notices.popleft()
            except IndexError:  # another thread was faster
                return
            if self._on_drop is not None:
                self._on_drop(*notice)

    def _pop_ready(self) -> '_Held | None':
        with self._lock:
            if not self._ready:
                return None
            self._delivered += 1
            return self._ready.pop(next(iter(self._ready)))

    def _transforms(self, held: '_Held') -> TransformStamped | dict[str, TransformStamped]:
        transforms = {target: transform_stamped(target, held.frame, stamp, pose)
                      for target, stamp, pose in held.answer}
        return transforms if self._several else transforms[self._targets[0]]


class _Held:
    """A message in a filter; it is changed only with the filter's lock held."""

    def __init__(self, owner: MessageFilter, message: object, arrival: Arrival) -> None:
        self._owner = owner
        self.message = message
        self.arrival = arrival
        self.number = arrival.number
        self.frame = arrival.frame
        self.answer: _Answer = []
        self.wait = Wait(owner._buffer.timeouts, self,
                         lambda: owner._query(arrival.frame, arrival.stamp), owner._timeout,
                         owner._lock)

    def answered(self, answer: _Answer) -> None:
        """Deliver the message with its transforms."""
        self.wait.end()
        self.answer = answer
        self._owner._found(self)

    def failed(self, error: TransformException) -> None:
        """Drop the message for this reason."""
        self._owner._drop(self, _drop_for(error, released=self.wait.released), str(error))
