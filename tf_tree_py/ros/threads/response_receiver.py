"""
A thread that takes the responses to a node's service clients, and nothing else.

A response goes to every client of its service, and all but one throw it away. An
executor takes about 120 us of CPU to do so, waiting on the clients themselves a
quarter: of a hundred clients that is what each lookup of any of them costs.
"""

from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
import time
from typing import Any

from rclpy.client import Client
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from .receiver import HAS_WAIT_SET, Receiver

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
    CAN_TAKE = HAS_WAIT_SET and hasattr(_rclpy.Client, 'take_response')
except (ImportError, AttributeError):  # pragma: no cover - every rclpy so far has it
    CAN_TAKE = False

# Nanoseconds, 146 years.
_NEVER = 2**62
# Ctrl-C wakes us a moment before it ends the context, and then tells nobody.
_AFTER_A_WAKE_NS = 1_000_000_000


class Responses(Receiver):
    """
    Serves every service client of a node that is ours alone, in one daemon thread.

    Callbacks of the clients' futures run in the thread. Otherwise a ``Receiver``.
    """

    def __init__(self, node: Node, on_end: Callable[[], object], check: Callable[[], bool],
                 period_s: float, *, use_wait_set: bool = CAN_TAKE) -> None:
        """
        Begin to serve.

        :param node: whose clients; it now belongs to this.
        :param on_end: called by the thread as the last thing.
        :param check: called by the thread after ``wake``, and then once in a period for
            as long as it returns True.
        """
        self._check = check
        self._period_ns = round(period_s * 1e9)
        if not use_wait_set:
            # Always, for an executor has to be woken to see that a timer goes again.
            node.create_timer(period_s, check, clock=Clock(clock_type=ClockType.STEADY_TIME))
        super().__init__(node, on_end, use_wait_set=use_wait_set)

    def _serve(self) -> None:
        clients = list(self._node.clients)
        with ExitStack() as in_use:
            for entity in (self._wake.handle, *(client.handle for client in clients)):
                in_use.enter_context(entity)
            wait_set: Any = _rclpy.WaitSet(0, 1, 0, len(clients), 0, 0, self.context.handle)
            check_at, timeout = _NEVER, _AFTER_A_WAKE_NS
            while self._goes_on():
                self._sleep(wait_set, clients, timeout)
                woken = wait_set.is_ready('guard_condition', 0)
                for index, client in enumerate(clients):
                    if wait_set.is_ready('client', index):
                        self._take(client)
                now = time.monotonic_ns()
                if woken or now >= check_at:
                    check_at = now + self._period_ns if self._look_after() else _NEVER
                timeout = min(check_at - now, _AFTER_A_WAKE_NS if woken else _NEVER)

    def _look_after(self) -> bool:
        try:
            return self._check()
        except BaseException:  # noqa: B902 - whatever it is, the next must get through
            self._complain('a check')
            return True

    def _sleep(self, wait_set: Any, clients: Iterable[Client], timeout: int) -> None:
        wait_set.clear_entities()
        for client in clients:
            wait_set.add_client(client.handle)
        wait_set.add_guard_condition(self._wake.handle)
        wait_set.wait(timeout)

    def _take(self, client: Client) -> None:
        """Take one response, and hand it to whoever waits for it."""
        handle: Any = client.handle
        kind: Any = client.srv_type
        try:
            header, response = handle.take_response(kind.Response)
            if header is None:
                return  # another client's
            with suppress(KeyError):  # nobody waits for it any more
                client.get_pending_request(header.request_id.sequence_number).set_result(response)
        except BaseException:  # noqa: B902 - whatever it is, the next must get through
            self._complain(f'a response of {client.srv_name}')
