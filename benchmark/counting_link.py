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

"""A link over TCP that counts what goes through it."""

import asyncio
from collections.abc import Callable, Coroutine
import socket
import threading
import time
from typing import Any


def free_port() -> int:
    """Return a port of this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


class CountingLink:
    """
    Passes connections on, in a thread of its own.

    :ivar port: where it listens, on this machine only.
    :ivar sent: how many bytes went to the other side so far.
    """

    def __init__(self, to_port: int) -> None:
        self.port, self.sent = free_port(), 0
        self._to_port = to_port
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._run(asyncio.start_server(self._pass_on, '127.0.0.1', self.port))

    def _run(self, task: Coroutine[Any, Any, object]) -> None:
        asyncio.run_coroutine_threadsafe(task, self._loop).result()

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        back, forth = await asyncio.open_connection('127.0.0.1', self._to_port)
        await asyncio.gather(self._pump(reader, forth, True), self._pump(back, writer, False))

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                    counts: bool) -> None:
        while data := await reader.read(65536):
            self.sent += len(data) if counts else 0
            writer.write(data)
            await writer.drain()
        writer.close()

    def await_bytes(self, count: int, send: Callable[[], object]) -> bool:
        """Send, and return whether so many bytes have gone; not in a second: False."""
        goal, end = self.sent + count, time.monotonic() + 1.0
        send()
        while self.sent < goal:
            if time.monotonic() > end:
                return False
            time.sleep(1e-4)
        return True

    def close(self) -> None:
        """End the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
