"""
A thread that takes the messages of a node's subscriptions, and nothing else.

An executor costs about 250 us of CPU a message; waiting on the subscriptions
themselves and draining them costs less than a third. That needs rclpy's
private ``WaitSet`` and ``take_message``, which only this file touches; where
they are missing, an executor of our own spins the node instead.
"""

import atexit
from contextlib import ExitStack, suppress
import threading
import traceback
from typing import Any
import weakref

from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.subscription import Subscription

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
    HAS_WAIT_SET = hasattr(_rclpy, 'WaitSet') and hasattr(_rclpy.Subscription, 'take_message')
except ImportError:  # pragma: no cover - every rclpy so far has it
    HAS_WAIT_SET = False

_FOREVER = -1
_running: 'weakref.WeakSet[Receiver]' = weakref.WeakSet()

# So that a flood on one topic does not starve the others.
_MAX_TAKEN_AT_ONCE = 100


class Receiver:
    """
    Serves every subscription of a node that is ours alone, in one daemon thread.

    The thread ends with ``close``, or when the context shuts down. It owns the
    node and destroys it at its end, so that nothing is destroyed while in use.
    """

    def __init__(self, node: Node, *, use_wait_set: bool = HAS_WAIT_SET) -> None:
        self._node = node
        self._closing = False
        self._wake = node.create_guard_condition(lambda: None)
        self._executor: SingleThreadedExecutor | None = None
        if not use_wait_set:
            self._executor = SingleThreadedExecutor(context=node.context)
            self._executor.add_node(node)
        self._thread = threading.Thread(
            target=self._run, name=f'{node.get_name()} receiver', daemon=True)
        node.context.on_shutdown(self.stop)
        self._thread.start()
        _running.add(self)

    @property
    def thread_id(self) -> int | None:
        """The identifier of the thread, as ``threading.get_ident`` gives it."""
        return self._thread.ident

    def wake(self) -> None:
        """Look at the node's subscriptions anew."""
        # Once the thread has ended, the node is gone with it.
        with suppress(InvalidHandle):
            self._wake.trigger()

    def stop(self) -> None:
        """Tell the thread to end."""
        self._closing = True
        if self._executor is not None:
            self._executor.shutdown(timeout_sec=0.0)
        self.wake()

    def close(self) -> None:
        """End the thread, and wait for it unless called from it."""
        self.stop()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        try:
            if self._executor is not None:
                self._executor.spin()
            else:
                self._serve()
        except ExternalShutdownException:
            pass
        finally:
            self._node.destroy_node()

    def _serve(self) -> None:
        while not self._closing and self._node.context.ok():
            # The clock's subscription comes and goes with use_sim_time.
            subscriptions = list(self._node.subscriptions)
            with ExitStack() as in_use:
                for entity in (*subscriptions, self._wake):
                    in_use.enter_context(entity.handle)
                self._wait(subscriptions)
                for subscription in subscriptions:
                    self._drain(subscription)

    def _wait(self, subscriptions: list[Subscription]) -> None:
        wait_set: Any = _rclpy.WaitSet(
            len(subscriptions), 1, 0, 0, 0, 0, self._node.context.handle)
        wait_set.clear_entities()
        for subscription in subscriptions:
            wait_set.add_subscription(subscription.handle)
        wait_set.add_guard_condition(self._wake.handle)
        wait_set.wait(_FOREVER)

    def _drain(self, subscription: Subscription) -> None:
        handle: Any = subscription.handle
        for _ in range(_MAX_TAKEN_AT_ONCE):
            taken = handle.take_message(subscription.msg_type, subscription.raw)
            if taken is None:
                return
            try:
                subscription.callback(taken[0])
            except Exception:  # noqa: B902 - whatever it is, the next message must get through
                self._node.get_logger().error(
                    f'a callback of {subscription.topic_name} failed:\n{traceback.format_exc()}')


@atexit.register
def _close_all() -> None:
    """End every thread while the interpreter is still whole."""
    for receiver in list(_running):
        receiver.close()
