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

"""Who tells a recorder to write: Enter, a signal, and, where there is ROS, a service."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import signal
import sys
import threading
from typing import Any


class DumpRequests:
    """
    What asked for a recording since the last look; from any thread.

    :ivar SIGNAL: which a process sends to ask.
    """

    SIGNAL = signal.SIGUSR1

    def __init__(self) -> None:
        """Hear Enter and the signal from now on; in the main thread."""
        self._who: list[str] = []
        signal.signal(self.SIGNAL, lambda *_: self._who.append('SIGUSR1'))
        # In the background a terminal would stop whoever reads it; so the read fails instead.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._read, name='Enter', daemon=True).start()

    def take(self) -> list[str]:
        """Return who asked since the last time."""
        taken, self._who = self._who, []
        return taken

    def _read(self) -> None:
        with suppress(OSError, ValueError):
            for _ in sys.stdin or ():
                self._who.append('Enter')

    @contextmanager
    def served_as(self, name: str) -> Iterator[None]:
        """Serve ``~/dump`` of a node meanwhile; rclpy is initialised."""
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
        from rclpy.node import Node
        from std_srvs.srv import Trigger
        node = Node(name)
        executor = SingleThreadedExecutor()
        executor.add_node(node)

        def dump(_: Any, response: Any) -> Any:
            self._who.append('~/dump')
            response.success, response.message = True, 'it is written soon'
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
