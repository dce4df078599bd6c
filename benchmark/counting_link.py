# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A TCP proxy that counts the bytes that pass through it."""

import asyncio
from collections.abc import Callable, Coroutine
import socket
import threading
import time
from typing import Any


def free_port() -> int:
    """Return an unused port of this machine."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


class CountingLink:
    """
    Forwards connections in an internal thread.

    :ivar port: the port on which it listens, on this machine only.
    :ivar sent: number of bytes sent to the other side so far.
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
        """Send; return whether this number of bytes has passed within a second."""
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
