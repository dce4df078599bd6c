# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A thread that takes the responses to a node's service clients, and nothing else.

DDS sends each response to every client of the service, and all but one discard it. An executor
needs about 120 us of CPU a client for that; waiting on the clients directly needs a quarter. With
a hundred clients, each lookup of one of them has that cost a hundred times.

The rules are those of ``receiver``. The clients are read once, so all are made before the thread.
"""

from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
import time
from typing import Any

from rclpy.client import Client
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

from .receiver import CHECK_CONTEXT_NS, HAS_WAIT_SET, Receiver

# Nanoseconds, 146 years.
_NEVER = 2**62


class Responses(Receiver):
    """
    A daemon thread that serves every service client of a node that is in no executor.

    Callbacks of the clients' futures run in the thread. Everything else is as in ``Receiver``.
    """

    def __init__(self, node: Node, on_end: Callable[[], object], check: Callable[[], bool],
                 period_s: float, *, use_wait_set: bool = HAS_WAIT_SET) -> None:
        """
        Begin to serve.

        :param node: the node with the clients; it now belongs to this object.
        :param on_end: the thread calls it last.
        :param check: the thread calls it after ``wake``, and then once in a period as long as it
            returns True.
        """
        self._check = check
        self._period_ns = round(period_s * 1e9)
        if not use_wait_set:
            # It is never cancelled: an executor would have to be woken to notice its restart.
            node.create_timer(period_s, check, clock=Clock(clock_type=ClockType.STEADY_TIME))
        super().__init__(node, on_end, use_wait_set=use_wait_set)

    def _serve(self) -> None:
        clients = list(self._node.clients)
        with ExitStack() as in_use:
            for entity in (self._wake.handle, *(client.handle for client in clients)):
                in_use.enter_context(entity)
            wait_set = _rclpy.WaitSet(0, 1, 0, len(clients), 0, 0, self.context.handle)
            check_at, timeout = _NEVER, CHECK_CONTEXT_NS
            while self._goes_on():
                self._sleep(wait_set, clients, timeout)
                self._tick()
                woken = wait_set.is_ready('guard_condition', 0)
                for index, client in enumerate(clients):
                    if wait_set.is_ready('client', index):
                        self._receive(client)
                now = time.monotonic_ns()
                if woken or now >= check_at:
                    check_at = now + self._period_ns if self._look_after() else _NEVER
                timeout = min(check_at - now, CHECK_CONTEXT_NS)

    def _look_after(self) -> bool:
        try:
            return self._check()
        except BaseException:  # noqa: B902 - no error may prevent the next check
            self._log_failure('a check')
            return True

    def _sleep(self, wait_set: Any, clients: Iterable[Client], timeout: int) -> None:
        wait_set.clear_entities()
        for client in clients:
            wait_set.add_client(client.handle)
        wait_set.add_guard_condition(self._wake.handle)
        wait_set.wait(timeout)

    def _receive(self, client: Client) -> None:
        """Receive one response, and pass it to the request that waits for it."""
        handle = client.handle
        srv_type: Any = client.srv_type
        try:
            header, response = handle.take_response(srv_type.Response)
            if header is None:
                return  # it was for another client
            with suppress(KeyError):  # the request was cancelled
                client.get_pending_request(header.request_id.sequence_number).set_result(response)
        except BaseException:  # noqa: B902 - no error may prevent the next response
            self._log_failure(f'a response of {client.srv_name}')
