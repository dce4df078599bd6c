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

"""Holds messages until they can be transformed, and calls back with both."""

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
import threading
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import await_or_execute
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import Header
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import LATEST

from .drop_reasons import Drop as Drop, drop_for, FilterStatistics
from ..buffer.buffer import Buffer
from ..buffer.interface import NO_TIME
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..messages.convert import as_nanoseconds, transform_stamped
from ..topics.qos import sensor_qos
from ..waiting.timeouts import Wait

# For each target frame its name, the stamp that was found, and target_T_frame.
_Answer = list[tuple[str, int, PoseTuple]]


class MessageFilter:
    """
    Calls back with a message and its transform, once there is one.

    The callback gets the transform that was found, and need not look it up again: it may
    be gone by then. Each message is either passed to the callback once, or dropped. Drops
    are counted by reason, and ``on_drop`` is called with them.

    Callbacks run in the node's executor, as a subscription's do. Messages of one frame come
    in the order in which they were added; one whose transform is missing does not hold up
    those behind it. Messages of different frames come as their transforms are found.

    All methods may be called from any thread. A filter lives as long as its node or
    until ``close()``; it is a context manager.
    """

    def __init__(self, buffer: Buffer, node: Node, target_frames: str | Sequence[str],
                 callback: Callable[[Any, Any], Any], *, queue_size: int = 10,
                 tolerance: Any = NO_TIME, timeout: Any = None,
                 on_drop: Callable[[Any, Drop, str], None] | None = None,
                 header_of: Callable[[Any], Header] | None = None,
                 callback_group: CallbackGroup | None = None) -> None:
        """
        Begin with an empty queue; ``add``, ``subscribe`` and ``connect`` fill it.

        :param node: whose executor calls back.
        :param target_frames: one, or several that must all be reachable.
        :param callback: takes a message and its ``TransformStamped``, or with several
            targets a dict of them by target frame; may be a coroutine function.
        :param queue_size: how many messages may wait for their transforms, and how many
            for the executor; beyond that the oldest is dropped. 0: any number.
        :param tolerance: an rclpy ``Duration``; there must also be transforms for a time
            that much later than the message's.
        :param timeout: how long a message may wait for its transforms, by the buffer's
            clock; None: until the queue is full.
        :param on_drop: takes a dropped message, the reason, and a sentence. It runs in the
            executor as ``callback`` does; ``close``, and ``add`` after it, call it
            directly.
        :param header_of: returns a message's header, if that is not its ``header``.
        :param callback_group: the node's own unless given.
        :raises TypeError: another buffer than ours, such as tf2's.
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
        self._lock = threading.RLock()
        self._closed = False
        self._received = self._delivered = 0
        self._dropped = dict.fromkeys(Drop, 0)
        self._waiting: dict[int, _Held] = {}
        self._ready: dict[int, _Held] = {}
        self._notices: deque[tuple[Any, Drop, str]] = deque()
        self._bell = node.create_guard_condition(self._call_back, callback_group)

    # --- filling

    def add(self, message: Any) -> None:
        """Take a message; also as a subscription's callback."""
        header = message.header if self._header_of is None else self._header_of(message)
        frame, stamp = header.frame_id.removeprefix('/'), as_nanoseconds(header.stamp)
        with self._lock:
            number = self._received = self._received + 1
            held = _Held(self, number, message, frame, stamp)
            if self._closed:
                self._drop(held, Drop.CLOSED)
            elif not frame:
                self._drop(held, Drop.EMPTY_FRAME)
            else:
                self._waiting[number] = held
                held.wait.ask()
                self._make_room(self._waiting)
        if self._closed:
            self._tell_drops()

    def subscribe(self, msg_type: Any, topic: str,
                  qos: QoSProfile | int | None = None) -> Subscription:
        """
        Add every message of a topic; the subscription ends with the filter.

        :param qos: best effort, volatile, depth 10 unless given: that matches every
            publisher. A reliable subscription gets nothing from best-effort sensors. An
            int is the depth of a reliable one, as in rclpy.
        """
        subscription = self._node.create_subscription(
            msg_type, topic, self.add, sensor_qos() if qos is None else qos,
            callback_group=self._group)
        self._subscriptions.append(subscription)
        return subscription

    def connect(self, source: Any) -> None:
        """Add every message of a ``message_filters`` filter, such as its ``Subscriber``."""
        source.registerCallback(self.add)

    def statistics(self) -> FilterStatistics:
        """Return the counts, all of one moment."""
        with self._lock:
            return FilterStatistics(self._received, self._delivered, dict(self._dropped),
                                    len(self._waiting) + len(self._ready))

    def close(self) -> None:
        """Drop all messages that are held, and those that are still added."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            for held in [*self._waiting.values(), *self._ready.values()]:
                self._drop(held, Drop.CLOSED)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._node.destroy_guard_condition(self._bell)
        self._tell_drops()

    def __enter__(self) -> 'MessageFilter':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- with the lock

    def _query(self, frame: str, stamp: int) -> _Answer:
        answer = [(target, *self._buffer.lookup_stamped(target, frame, stamp))
                  for target in self._targets]
        if self._tolerance > 0 and stamp != LATEST:
            for target in self._targets:
                self._buffer.lookup_stamped(target, frame, stamp + self._tolerance)
        return answer

    def _found(self, held: '_Held') -> None:
        """Move a message whose transforms were found to those that are ready."""
        # The same transform may have completed an earlier message too, whose thread has not
        # asked again yet. It has to come first.
        for earlier in list(self._waiting.values()):
            if earlier.number >= held.number:
                break
            if earlier.frame == held.frame and earlier.wait.is_being_woken:
                earlier.wait.ask()
        del self._waiting[held.number]
        self._ready[held.number] = held
        self._make_room(self._ready)
        self._ring()

    def _make_room(self, line: dict[int, '_Held']) -> None:
        if 0 < self._queue_size < len(line):
            self._drop(next(iter(line.values())), Drop.QUEUE_FULL)

    def _drop(self, held: '_Held', drop: Drop, why: str = '') -> None:
        held.wait.end()
        self._waiting.pop(held.number, None)
        self._ready.pop(held.number, None)
        self._dropped[drop] += 1
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
            self._tell_drops()
            for _ in range(ready):
                held = self._take_ready()
                if held is not None:
                    await await_or_execute(self._callback, held.message, self._transforms(held))
        finally:
            if self._ready or self._notices:
                self._ring()

    def _tell_drops(self) -> None:
        for _ in range(len(self._notices)):
            try:
                notice = self._notices.popleft()
            except IndexError:  # another thread was faster
                return
            if self._on_drop is not None:
                self._on_drop(*notice)

    def _take_ready(self) -> '_Held | None':
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
    """A message in a filter; whatever changes it holds the filter's lock."""

    def __init__(self, owner: MessageFilter, number: int, message: Any, frame: str,
                 stamp: int) -> None:
        self._owner = owner
        self.number = number
        self.message = message
        self.frame = frame
        self.answer: _Answer = []
        self.wait = Wait(owner._buffer.timeouts, self, lambda: owner._query(frame, stamp),
                         owner._timeout, owner._lock)

    def answered(self, answer: _Answer) -> None:
        """Be passed on with its answer."""
        self.wait.end()
        self.answer = answer
        self._owner._found(self)

    def failed(self, error: TransformException) -> None:
        """Be dropped for this reason."""
        self._owner._drop(self, drop_for(error, released=self.wait.released), str(error))
