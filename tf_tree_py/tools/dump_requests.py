# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Requests to a recorder to write: Enter, a signal, and, if there is ROS, a service."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import signal
import sys
import threading
from typing import Any


class DumpRequests:
    """
    The requests for a recording since the last call of ``take``; from any thread.

    :ivar SIGNAL: the signal that requests one.
    """

    SIGNAL = signal.SIGUSR1

    def __init__(self) -> None:
        """Listen for Enter and the signal from now on; in the main thread."""
        self._who: list[str] = []
        signal.signal(self.SIGNAL, lambda *_: self._who.append('SIGUSR1'))
        # A terminal would stop a background process that reads it; with this the read fails
        # instead.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._read, name='Enter', daemon=True).start()

    def take(self) -> list[str]:
        """Return the sources of the requests since the last call."""
        taken, self._who = self._who, []
        return taken

    def _read(self) -> None:
        with suppress(OSError, ValueError):
            for _ in sys.stdin or ():
                self._who.append('Enter')

    @contextmanager
    def served_as(self, name: str) -> Iterator[None]:
        """Serve ``~/dump`` of a node in the meantime; rclpy has to be initialised."""
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
        from rclpy.node import Node
        from std_srvs.srv import Trigger
        node = Node(name)
        executor = SingleThreadedExecutor()
        executor.add_node(node)

        def dump(_: Any, response: Any) -> Any:
            self._who.append('~/dump')
            response.success, response.message = True, 'the bag will be written shortly'
            return response

        def spin() -> None:
            with suppress(ExternalShutdownException):
                executor.spin()

        node.create_service(Trigger, '~/dump', dump)
        thread = threading.Thread(target=spin, name='~/dump')
        thread.start()
        try:
            yield
        finally:
            executor.shutdown()
            thread.join()
            node.destroy_node()
