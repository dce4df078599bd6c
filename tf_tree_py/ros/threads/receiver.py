# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A thread that takes the messages of a node's subscriptions, and nothing else.

An executor needs about 250 us of CPU a message. Waiting on the subscriptions directly and draining
them costs less than a third of that. It requires rclpy's private ``WaitSet`` and ``take_message``.
Only this file and ``responses`` use them; if they are missing, an executor spins the small node.

The rules:

- Only the thread reads from the node, and all callbacks run in it. It holds no lock while it calls
  them, and no exception of theirs ends it.
- The node is destroyed once (``_destroyed``), and not before ``_has_served`` is set.
- Until then the thread does not take the lock of the context, except in an executor. A thread that
  shuts the context down holds that lock, and waits for ``_has_served``.
- ``wake`` and ``stop`` take no lock: finalizers call ``stop``, in the middle of any thread.
"""

import atexit
from collections import deque
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
from rclpy.subscription import Subscription

from .internal_node import CallbackFailures, is_locked_here, is_running

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
    _NEEDED = _rclpy.WaitSet, _rclpy.Subscription.take_message, _rclpy.Client.take_response
    HAS_WAIT_SET = True
except (ImportError, AttributeError):  # pragma: no cover - every rclpy so far has them
    HAS_WAIT_SET = False

# Ctrl-C ends the context without a callback and without a wake-up, so the thread checks the
# context this often. rclpy's ``SignalHandlerGuardCondition`` would wake it, but rclpy's signal
# thread reads its list of them while other threads destroy theirs, which crashes the process
# (docs/ending.md).
CHECK_CONTEXT_NS = 1_000_000_000
# It waits no longer than that, so it also writes counts.
_TICK_S = 1.0
_running: 'weakref.WeakSet[Receiver]' = weakref.WeakSet()
_contexts: 'weakref.WeakSet[Context]' = weakref.WeakSet()

# Wake-ups cost the most. If messages are closer together than _BUSY_S, the thread sleeps for
# _REST_S between two reads and takes several messages at a time.
_BUSY_S = 0.005
_REST_S = 0.004
# Nothing wakes the thread from these rests, so it goes back to waiting after 0.1 s of them.
_RESTS = 25

# The longest wait for a thread to end. It ends at once, unless a callback in it hangs.
_PATIENCE_S = 10.0

# The longest time for which the shutdown of a context waits until all its threads stop reading.
LAST_READ_S = 1.0

# A flood on one topic must not starve the others. Other threads get no turn between two messages,
# although a control loop would then wake less late: a thread that computes would keep each turn
# for 5 ms, and messages would be lost.
_MAX_TAKEN_AT_ONCE = 100


class Receiver:
    """
    A daemon thread that serves every subscription of a node that is in no executor.

    The thread ends with ``close``, or when the context shuts down. The node belongs to the
    receiver, and is destroyed when its subscriptions are no longer read: by the thread, or by the
    thread that closes the receiver while it shuts down the context.

    :ivar thread: the thread.
    """

    def __init__(self, node: Node, on_end: Callable[[], object], *,
                 rest: Callable[[float], object] = time.sleep,
                 end_rest: Callable[[], object] = lambda: None,
                 work: Callable[[], bool] = lambda: False,
                 write_counts: Callable[[], object] = lambda: None,
                 is_wanted: Callable[[], bool] = lambda: True,
                 use_wait_set: bool = HAS_WAIT_SET) -> None:
        """
        Begin to serve.

        :param node: the node with the subscriptions; it now belongs to the receiver.
        :param on_end: the thread calls it last.
        :param write_counts: of a ``LimitedLog``; the thread calls it about once a second.
        :param rest: sleeps for so many seconds, or less if a lookup waits in the buffer; called
            between messages in quick succession.
        :param end_rest: lets ``rest`` return.
        :param work: does a few milliseconds of longer work, and returns whether more is left;
            called between messages.
        :param is_wanted: returns whether to go on; called before messages are read.
        """
        self._node = node
        self._is_wanted = is_wanted
        self._on_end = on_end
        self._rest = rest
        self._end_rest = end_rest
        self._work = work
        self._write_counts = write_counts
        self._counted_at = time.monotonic()
        self._closing = False
        # Whether the node may have other subscriptions; and who waits until all has been read.
        self._changed = False
        self._catching_up: deque[threading.Event] = deque()
        self._reads_directly = use_wait_set
        # Set when the thread no longer uses the node.
        self._has_served = threading.Event()
        self._destroyed = threading.Lock()
        self._failures = CallbackFailures(node.get_logger())
        self._wake = (GuardCondition(None, None, context=node.context) if use_wait_set
                      else node.create_guard_condition(lambda: None))
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
        """Read the node's list of subscriptions again."""
        # In this order: the thread looks at the flag when it is woken.
        self._changed = True
        self._trigger()

    def catch_up(self, longest_s: float) -> None:
        """Wait until the thread has read what has arrived, unless this is it, or it has ended."""
        if (threading.current_thread() is self.thread or not self._reads_directly
                or self._has_served.is_set()):
            return
        caught_up = threading.Event()
        self._catching_up.append(caught_up)
        self._end_rest()
        self._trigger()
        caught_up.wait(longest_s)

    def _trigger(self) -> None:
        # The guard condition is destroyed when the thread ends.
        with suppress(InvalidHandle):
            self._wake.trigger()

    def stop(self) -> None:
        """Signal the thread to end, and do not wait for it."""
        self._closing = True
        self.wake()

    def wait_for_last_read(self, longest_s: float) -> None:
        """
        Wait until the thread no longer uses the node.

        Return at once in the thread itself, and for an executor: that asks rclpy whether the
        context has ended, which needs the lock that the caller holds.
        """
        if self._reads_directly and threading.current_thread() is not self.thread:
            self._has_served.wait(max(longest_s, 0.0))

    def close(self) -> None:
        """
        End the thread, and wait for it unless called from it.

        A thread that shuts the context down holds its lock, without which no other thread can
        destroy a node. It destroys the node itself, and does not wait for the other thread to end.
        """
        self.stop()
        if threading.current_thread() is self.thread:
            return
        if not is_locked_here(self.context):
            self.thread.join(_PATIENCE_S)
        elif self._has_served.wait(_PATIENCE_S):
            self._destroy()

    def _run(self, loop: Callable[[], None]) -> None:
        try:
            loop()
        except Exception:
            # When the context ends, rclpy raises anything.
            if self._goes_on():
                raise
        finally:
            # First: a shutdown waits for it with the lock of the context held, which the
            # destruction of a node takes on Kilted.
            self._has_served.set()
            try:
                self._destroy()
            finally:
                self._end()

    def _destroy(self) -> None:
        """Destroy the node, unless another thread does."""
        if self._destroyed.acquire(blocking=False):
            self._wake.destroy()
            self._node.destroy_node()

    def _end(self) -> None:
        try:
            self._on_end()
        except BaseException:  # noqa: B902 - callbacks of abandoned waits may raise anything
            self._failures.report('a callback')

    def _goes_on(self) -> bool:
        return not self._closing and is_running(self.context) and self._is_wanted()

    def _tick(self) -> None:
        """Write the counts of ended floods, if that was a second ago."""
        now = time.monotonic()
        if now >= self._counted_at + _TICK_S:
            self._counted_at = now
            try:
                self._write_counts()
                self._failures.write_counts()
            except BaseException:  # noqa: B902 - no error may prevent the next callback
                self._log_failure('a log')

    def _spin(self) -> None:
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self._node)
        while self._goes_on():
            try:
                executor.spin_once(timeout_sec=self._work_on() / 1e9)
            except ExternalShutdownException:
                break
            except BaseException:  # noqa: B902 - no error may prevent the next callback
                self._log_failure('a callback')
            self._tick()
        executor.shutdown()

    def _serve(self) -> None:
        while self._goes_on():
            # The clock's subscription appears and disappears with use_sim_time, at any moment.
            self._changed = False
            with suppress(InvalidHandle), ExitStack() as in_use:
                self._serve_these(list(self._node.subscriptions), in_use)

    def _serve_these(self, subscriptions: list[Subscription], in_use: ExitStack) -> None:
        """Serve subscriptions until the thread is woken, when the node may have others."""
        events = [event for subscription in subscriptions
                  for event in cast('list[EventHandler]', subscription.event_handlers)]
        pairs = [(subscription, _takes_info(subscription.callback))
                 for subscription in subscriptions]
        handles = [subscription.handle for subscription in subscriptions]
        for entity in (self._wake.handle, *events, *handles):
            in_use.enter_context(entity)
        wait_set = _rclpy.WaitSet(len(handles), 1, 0, 0, 0, len(events), self.context.handle)
        woken = False
        last = time.monotonic()
        while not woken and self._goes_on():
            timeout = self._work_on()
            self._wait(wait_set, handles, events, timeout)
            self._tick()
            woken = wait_set.is_ready('guard_condition', 0) and self._changed
            for event in [event for event in events if event.is_ready(wait_set)]:
                self._tell(event)
            last, before = time.monotonic(), last
            taken = self._drain_all(pairs)
            busy = last - before < _BUSY_S and not woken and timeout
            for _ in range(_RESTS if busy else 0):
                if not taken or self._closing:
                    break
                # Let a few messages accumulate, unless a lookup waits for them.
                self._rest(_REST_S)
                taken = self._drain_all(pairs)

    def _work_on(self) -> int:
        """Do some of the longer work; return how long to wait then, nanoseconds."""
        try:
            return 0 if self._work() else CHECK_CONTEXT_NS
        except BaseException:  # noqa: B902 - no error may prevent the next callback
            self._log_failure('a callback')
            return 0

    def _wait(self, wait_set: Any, handles: Sequence[Any], events: Sequence[EventHandler],
              timeout: int) -> None:
        """Sleep until a message, an event, ``wake``, or the timeout, nanoseconds."""
        wait_set.clear_entities()
        for handle in handles:
            wait_set.add_subscription(handle)
        for event in events:
            event.add_to_wait_set(wait_set)
        wait_set.add_guard_condition(self._wake.handle)
        wait_set.wait(timeout)

    def _drain_all(self, pairs: Iterable[tuple[Subscription, bool]]) -> int:
        if not self._is_wanted():
            return 0
        # Not those that begin to wait during the reading.
        waiting = len(self._catching_up)
        taken = sum(self._drain(*each) for each in pairs)
        for _ in range(waiting):
            self._catching_up.popleft().set()
        return taken

    def _tell(self, event: EventHandler) -> None:
        """Let rclpy log which publishers do not match, in their QoS or their type."""
        try:
            event.callback(event.take_data())
        except BaseException:  # noqa: B902 - no error may prevent the next callback
            self._log_failure('an event')

    def _drain(self, subscription: Subscription, with_info: bool) -> int:
        """Take the messages that have arrived; return the count."""
        handle = subscription.handle
        take, msg_type, raw = handle.take_message, subscription.msg_type, subscription.raw
        callback = subscription.callback
        for count in range(_MAX_TAKEN_AT_ONCE):
            try:
                taken = take(msg_type, raw)
                if taken is None:
                    return count
                if with_info:
                    callback(*taken)
                else:
                    callback(taken[0])
            except BaseException:  # noqa: B902 - no error may prevent the next callback
                self._log_failure(f'a callback of {subscription.topic_name}')
        return _MAX_TAKEN_AT_ONCE

    def _log_failure(self, what: str) -> None:
        # When the context ends, rclpy raises anything.
        if self._goes_on():
            self._failures.report(what)


def _takes_info(callback: Callable[..., object]) -> bool:
    """Return whether a callback takes rclpy's message info as a second argument."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        return True
    return False


def _stop_with(context: Context) -> None:
    """
    Stop a context's receivers when it shuts down.

    The shutdown also waits until they no longer read. A program destroys its executor next, and
    with it a guard condition that rclpy's signal thread may still be reading, which crashes the
    process (docs/ending.md). A node with subscriptions of its own takes the same time to destroy.

    One callback is registered for each context, not for each receiver: a context never removes its
    callbacks, and a weak method of each receiver would print an error if the receiver died with
    the interpreter.
    """
    def stop_all() -> None:
        context = ended()
        receivers = [receiver for receiver in list(_running) if receiver.context is context]
        for receiver in receivers:
            receiver.stop()
        end = time.monotonic() + LAST_READ_S
        for receiver in receivers:
            receiver.wait_for_last_read(end - time.monotonic())

    if context not in _contexts:
        _contexts.add(context)
        ended = weakref.ref(context)
        context.on_shutdown(stop_all)


@atexit.register
@atexit.register
def _close_all() -> None:
    """
    End every thread while the interpreter is still intact.

    Python would stop a thread that is left, which aborts the process (docs/ending.md). So another
    Ctrl-C only ends the wait for one thread, and since it may also come before the first line
    here, all of this is done twice.
    """
    for receiver in list(_running):
        # RuntimeError: Ctrl-C came before the thread started.
        with suppress(KeyboardInterrupt, RuntimeError):
            receiver.close()
