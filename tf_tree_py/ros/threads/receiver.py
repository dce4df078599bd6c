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
A thread that takes the messages of a node's subscriptions, and nothing else.

An executor costs about 250 us of CPU a message. Waiting on the subscriptions
directly and draining them costs less than a third of that. It needs rclpy's
private ``WaitSet`` and ``take_message``. Only this file and ``response_receiver``
touch them; where they are missing, an executor of our own spins the node instead.
"""

import atexit
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
import inspect
import threading
import time
from typing import Any, cast
import weakref

from rclpy.context import Context
from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.guard_condition import GuardCondition
from rclpy.node import Node
from rclpy.signals import SignalHandlerGuardCondition
from rclpy.subscription import Subscription

from .complaint import Complaint

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
    HAS_WAIT_SET = hasattr(_rclpy, 'WaitSet') and hasattr(_rclpy.Subscription, 'take_message')
except ImportError:  # pragma: no cover - every rclpy so far has it
    HAS_WAIT_SET = False

_FOREVER = -1
# Ctrl-C wakes the thread just before the context ends; the end itself wakes nobody.
# So after a wake the thread looks again after this time.
_AFTER_A_WAKE_NS = 1_000_000_000
_running: 'weakref.WeakSet[Receiver]' = weakref.WeakSet()
_contexts: 'weakref.WeakSet[Context]' = weakref.WeakSet()

# Waking up is what costs most. Where messages come closer together than _BUSY_S, the
# thread sleeps for _REST_S between two looks and takes several messages at a time.
_BUSY_S = 0.005
_REST_S = 0.004
# Nothing wakes the thread from these rests, so it goes back to waiting after 0.1 s of them.
_RESTS = 25

# A flood on one topic must not starve the others.
_MAX_TAKEN_AT_ONCE = 100


class Receiver:
    """
    Serves every subscription of a node that no executor has, in one daemon thread.

    The thread ends with ``close``, or when the context shuts down. It owns the
    node and destroys it at its end, so that nothing is destroyed while in use.

    :ivar thread: the thread.
    """

    def __init__(self, node: Node, on_end: Callable[[], object], *,
                 rest: Callable[[float], object] = time.sleep,
                 use_wait_set: bool = HAS_WAIT_SET) -> None:
        """
        Begin to serve.

        :param node: whose subscriptions; it now belongs to the receiver.
        :param on_end: the thread calls it last.
        :param rest: sleeps for so many seconds, or less if a lookup waits in the buffer;
            called between messages that come fast.
        """
        self._node = node
        self._on_end = on_end
        self._rest = rest
        self._closing = False
        self._complaint = Complaint(node.get_logger())
        self._wake: GuardCondition
        if use_wait_set:
            # On Ctrl-C the callbacks of context.on_shutdown are not called.
            self._wake = SignalHandlerGuardCondition(context=node.context)
        else:
            self._wake = node.create_guard_condition(lambda: None)
        self.thread = threading.Thread(
            target=self._run, args=(self._serve if use_wait_set else self._spin,),
            name=f'{node.get_name()} receiver', daemon=True)
        _running.add(self)
        _stop_with(node.context)
        self.thread.start()

    @property
    def context(self) -> Context:
        """Return the node's context; the thread ends when it shuts down."""
        return self._node.context

    def wake(self) -> None:
        """Look at the node's subscriptions anew."""
        # The guard condition is destroyed when the thread ends.
        with suppress(InvalidHandle):
            self._wake.trigger()

    def stop(self) -> None:
        """Tell the thread to end, and do not wait for it."""
        self._closing = True
        self.wake()

    def close(self) -> None:
        """End the thread, and wait for it unless called from it."""
        self.stop()
        if threading.current_thread() is not self.thread:
            self.thread.join()

    def _run(self, loop: Callable[[], None]) -> None:
        try:
            loop()
        except Exception:
            # When the context ends, rclpy raises anything.
            if self._goes_on():
                raise
        finally:
            try:
                self._wake.destroy()
                self._node.destroy_node()
            finally:
                self._end()

    def _end(self) -> None:
        try:
            self._on_end()
        except BaseException:  # noqa: B902 - callbacks of those who gave up may raise anything
            self._complaint.write('a callback')

    def _goes_on(self) -> bool:
        return not self._closing and self.context.ok()

    def _spin(self) -> None:
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self._node)
        while self._goes_on():
            try:
                executor.spin_once(timeout_sec=_AFTER_A_WAKE_NS / 1e9)
            except ExternalShutdownException:
                break
            except BaseException:  # noqa: B902 - whatever it is, the next must get through
                self._complain('a callback')
        executor.shutdown()

    def _serve(self) -> None:
        while self._goes_on():
            # The clock's subscription comes and goes with use_sim_time, at any moment.
            with suppress(InvalidHandle), ExitStack() as in_use:
                self._serve_these(list(self._node.subscriptions), in_use)

    def _serve_these(self, subscriptions: list[Subscription], in_use: ExitStack) -> None:
        """Serve subscriptions until the thread is woken: then the node may have others."""
        events: list[Any] = [event for subscription in subscriptions
                             for event in cast('Any', subscription.event_handlers)]
        sources = [(subscription, takes_info(subscription.callback))
                   for subscription in subscriptions]
        handles: list[Any] = [subscription.handle for subscription in subscriptions]
        for entity in (self._wake.handle, *events, *handles):
            in_use.enter_context(entity)
        wait_set: Any = _rclpy.WaitSet(
            len(handles), 1, 0, 0, 0, len(events), self.context.handle)
        timeout = _AFTER_A_WAKE_NS
        woken = False
        last = time.monotonic()
        while not woken and self._goes_on():
            self._wait(wait_set, handles, events, timeout)
            timeout = _FOREVER
            woken = wait_set.is_ready('guard_condition', 0)
            for event in [event for event in events if event.is_ready(wait_set)]:
                self._tell(event)
            last, before = time.monotonic(), last
            taken = self._drain_all(sources)
            busy = last - before < _BUSY_S and not woken
            for _ in range(_RESTS if busy else 0):
                if not taken or self._closing:
                    break
                # Let a few messages gather, unless a lookup waits for them.
                self._rest(_REST_S)
                taken = self._drain_all(sources)

    def _wait(self, wait_set: Any, handles: Sequence[Any], events: Sequence[EventHandler],
              timeout: int) -> None:
        """Sleep until there is a message or an event, the timeout is over, or ``wake``."""
        wait_set.clear_entities()
        for handle in handles:
            wait_set.add_subscription(handle)
        for event in events:
            event.add_to_wait_set(wait_set)
        wait_set.add_guard_condition(self._wake.handle)
        wait_set.wait(timeout)

    def _drain_all(self, sources: Iterable[tuple[Subscription, bool]]) -> int:
        return sum(self._drain(*source) for source in sources)

    def _tell(self, event: EventHandler) -> None:
        """Let rclpy log which publishers do not match, in their QoS or their type."""
        try:
            event.callback(event.take_data())
        except BaseException:  # noqa: B902 - whatever it is, the next must get through
            self._complain('an event')

    def _drain(self, subscription: Subscription, with_info: bool) -> int:
        """Take the messages that have arrived; return how many."""
        handle: Any = subscription.handle
        take, kind, raw = handle.take_message, subscription.msg_type, subscription.raw
        callback = subscription.callback
        for count in range(_MAX_TAKEN_AT_ONCE):
            try:
                taken = take(kind, raw)
                if taken is None:
                    return count
                if with_info:
                    callback(*taken)
                else:
                    callback(taken[0])
            except BaseException:  # noqa: B902 - whatever it is, the next must get through
                self._complain(f'a callback of {subscription.topic_name}')
        return _MAX_TAKEN_AT_ONCE

    def _complain(self, what: str) -> None:
        # When the context ends, rclpy raises anything.
        if self._goes_on():
            self._complaint.write(what)


def takes_info(callback: Callable[..., object]) -> bool:
    """Return whether a callback takes rclpy's message info as a second argument."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        return True
    return False


def _stop_with(context: Context) -> None:
    """
    Stop a context's receivers when it shuts down.

    One callback is registered for each context, not for each receiver: a context keeps its
    callbacks for ever, and a weak method of each receiver would print a complaint if the
    receiver died with the interpreter.
    """
    def stop_all() -> None:
        for receiver in list(_running):
            if receiver.context is ended():
                receiver.stop()

    if context not in _contexts:
        _contexts.add(context)
        ended = weakref.ref(context)
        context.on_shutdown(stop_all)


@atexit.register
def _close_all() -> None:
    """End every thread while the interpreter is still whole."""
    for receiver in list(_running):
        receiver.close()
