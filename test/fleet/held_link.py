# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A TCP link to a router; each of its directions can be held: bytes wait, and none is lost."""

from contextlib import contextmanager, suppress
import socket
import threading

from fleet_helpers import port_of


class HeldLink:
    """
    Forwards connections to a router.

    :ivar up: an event; while it is not set, nothing gets to the router.
    :ivar down: the same for what the router sends.
    """

    def __init__(self, router):
        self._router = ('127.0.0.1', port_of(router))
        # A small window, so that few bytes wait in the kernel.
        self._server = socket.socket()
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
        self._server.bind(('127.0.0.1', 0))
        self._server.listen()
        self.endpoint = f'tcp/127.0.0.1:{self._server.getsockname()[1]}'
        self.up, self.down = threading.Event(), threading.Event()
        self._release()
        self._start(self._accept)

    @contextmanager
    def held(self):
        """Hold both directions, until they are released or the context ends."""
        self.up.clear()
        self.down.clear()
        try:
            yield
        finally:
            self._release()

    def _release(self):
        self.up.set()
        self.down.set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._release()
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()

    def _start(self, work, *arguments):
        threading.Thread(target=work, args=arguments, daemon=True).start()

    def _accept(self):
        with suppress(OSError):  # closed
            while True:
                near, _ = self._server.accept()
                try:
                    far = socket.create_connection(self._router)
                except OSError:  # there is no router now
                    near.close()
                    continue
                self._start(self._forward, near, far, self.up)
                self._start(self._forward, far, near, self.down)

    def _forward(self, from_end, target, flows):
        with suppress(OSError):
            while data := from_end.recv(65_536):
                flows.wait()
                target.sendall(data)
        for end in (from_end, target):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
