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

"""Serves the pages, and draws them anew while there are any."""

import contextlib
import io
import threading
import time
import traceback
from typing import Any, Final
import warnings

import viser

from .page.page import Page
from .subject import Subject

RATE_HZ: Final = 30.0


class _Server(viser.ViserServer):
    """viser's server, which opens nothing to the world: a page may ask for that."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse to tunnel the page to a public address."""


class Serving:
    """
    A server of pages, with a thread that draws them.

    While no page is open, that thread sleeps. A context manager.
    """

    def __init__(self, subject: Subject, host: str, port: int, title: str) -> None:
        """
        Begin to serve.

        :param port: the first to try; those after it are tried next.
        :raises OSError: the host is no address of this machine, or no port is free.
        """
        self._subject = subject
        # Each with when it was drawn last, by the monotonic clock.
        self._pages: dict[int, tuple[Page, float]] = {}
        self._changed = threading.Condition()
        self._ended = False
        # What is drawn until a closed page is known to be closed goes nowhere, as it should.
        warnings.filterwarnings('ignore', 'Queued a .* on a closed connection', UserWarning)
        with contextlib.redirect_stdout(io.StringIO()):  # viser greets with a frame of its own
            self._server = _Server(host=host, port=port, label=title, verbose=False)
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)
        # A second Ctrl-C may interrupt the end of this: then the process must end all the same.
        self._thread = threading.Thread(target=self._draw, name='pages', daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Return the address of the page."""
        host = self._server.get_host()
        return f'http://{"localhost" if host == "0.0.0.0" else host}:{self._server.get_port()}'

    def wait_until_nobody_looks(self) -> None:
        """Return when no page is open."""
        with self._changed:
            self._changed.wait_for(lambda: not self._pages)

    def __enter__(self) -> 'Serving':
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._thread.join()
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def _open(self, client: Any) -> None:
        page = Page(client, self._subject)
        with self._changed:
            # It may be closed again already.
            if client.client_id in self._server.get_clients():
                self._pages[client.client_id] = page, time.monotonic()
                self._changed.notify_all()

    def _close(self, client: Any) -> None:
        with self._changed:
            self._pages.pop(client.client_id, None)
            self._changed.notify_all()

    def _draw(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or self._pages)
                if self._ended:
                    return
                pages = dict(self._pages)
            begun = time.monotonic()
            for number, (page, last) in pages.items():
                self._draw_one(number, page, begun - last)
                with self._changed:
                    if number in self._pages:
                        self._pages[number] = page, begun
            with self._changed:
                rest = begun + 1.0 / RATE_HZ - time.monotonic()
                self._changed.wait_for(lambda: self._ended, max(rest, 0.0))

    def _draw_one(self, number: int, page: Page, seconds: float) -> None:
        """Draw a page; one that cannot be drawn must not stop the others."""
        try:
            page.tick(seconds)
        except Exception:  # noqa: B902 - a fault, unless somebody has closed the page meanwhile
            with self._changed:
                self._pages.pop(number, None)
            if number in self._server.get_clients():
                traceback.print_exc()
