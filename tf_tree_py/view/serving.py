# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The server of the pages, with the thread that draws them.

Any website that is open in a browser on this machine can send requests to this server, so the
IP address of a request proves nothing. Its headers do, because a website cannot choose them:
``Origin`` is the website's own address, and ``Host`` is the name under which the browser found
this server. After DNS rebinding, that is a foreign name.

Threads send viser's messages. viser 1.1 sets an ``asyncio.Event`` for each message in the thread
that sends it, and again in the thread of the event loop. asyncio allows only the second: the first
can raise ``RuntimeError``, or set the event without waking the task that waits for it. That task
then sleeps forever, and the page stays as it is. On a busy machine both happen within minutes. So
the messages are made safe to send here.
"""

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Sequence
import contextlib
from hmac import compare_digest
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
import inspect
import io
from ipaddress import ip_address
import socket
import threading
import time
from typing import Any, Final, NamedTuple
from unittest import mock
from urllib.parse import parse_qs, urlsplit
import warnings

from tf_tree_py.limited_log import FailureLog
import viser
from websockets.asyncio import server as websockets_server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from .page.page import Page
from .request_log import print_line, RequestLogger
from .subject import Subject

_HeaderValues = Callable[[str], Sequence[str]]
"""Returns all values of a header."""

_LOCAL = 'localhost'


class Access(NamedTuple):
    """
    The conditions under which a request is accepted.

    :ivar host: the address or name of the server, as the user gave it.
    :ivar token: a secret that the first request must have in its address, and later ones in a
        cookie; '': no secret is required.
    """

    host: str
    token: str = ''

    def refusal(self, headers: _HeaderValues, path: str) -> str:
        """Return why a request is refused, in one sentence; '' if it is accepted."""
        host = _only(headers('Host'))
        if host is None:
            return 'a request needs one Host header'
        origins = headers('Origin')
        if origins and _place(_only(origins) or '') != _place(f'http://{host}'):
            return 'pages of other servers may not connect'
        if self.token:
            return '' if self._knows_token(headers, path) else (
                'open the page with its token: use the whole address that tf_view printed')
        if not self._is_name_of_ours(host):
            return ('this server is not known by that name: use its IP address, or localhost, or '
                    'start tf_view with --token')
        return ''

    def cookie(self, headers: _HeaderValues, path: str) -> str:
        """Return the cookie for the response to a request; '' if none is needed."""
        if not self._has_token(path):
            return ''
        # Browsers send cookies to all ports of a host, so the name contains the port.
        _, port = _place(f'http://{_only(headers("Host"))}') or ('', 0)
        return f'tf_view_{port}={self.token}; Path=/; HttpOnly; SameSite=Strict'

    def _knows_token(self, headers: _HeaderValues, path: str) -> bool:
        return self._has_token(path) or any(map(self._holds_token, headers('Cookie')))

    def _has_token(self, path: str) -> bool:
        given = parse_qs(urlsplit(path).query).get('token', [])
        return bool(self.token) and any(map(self._is_token, given))

    def _holds_token(self, cookies: str) -> bool:
        try:
            return any(self._is_token(morsel.value) for morsel in SimpleCookie(cookies).values())
        except CookieError:
            return False

    def _is_token(self, given: str) -> bool:
        return compare_digest(given.encode(), self.token.encode())

    def _is_name_of_ours(self, host: str) -> bool:
        """Return whether a host is a name of this machine or an IP address (never rebound)."""
        try:
            name = urlsplit(f'//{host}').hostname or ''
        except ValueError:
            return False
        own = socket.gethostname().lower()
        if name in (_LOCAL, self.host.lower(), own, f'{own}.local'):
            return True
        try:
            ip_address(name)
        except ValueError:
            return False
        return True


def _only(values: Sequence[str]) -> str | None:
    return values[0] if len(values) == 1 else None


def _place(origin: str) -> tuple[str | None, int | None] | None:
    """Return the host and the port of an origin; None if it is not a valid origin."""
    try:
        parts = urlsplit(origin)
        port = parts.port or {'http': 80, 'https': 443}.get(parts.scheme)
    except ValueError:
        return None
    return (parts.hostname, port) if parts.hostname else None


# --- waking viser

def wake_only_in_loop(client: Any) -> None:
    """
    Let only the thread of the event loop set the event for new messages.

    :param client: viser's handle of a page. The handle of another version of viser, which has
        no such event, stays as it is.
    """
    try:
        buffer = client._websock_connection.get_message_buffer()
        event, loop = buffer.message_event, buffer.event_loop
    except AttributeError:
        return
    set_event = event.set

    def set_in_loop() -> None:
        if _running_loop() is loop:
            set_event()

    event.set = set_in_loop


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None


# --- the server

RATE_HZ: Final = 30.0
# The colours of the light from above and below, sRGB.
_SKY: Final = (255, 255, 255)
_FLOOR: Final = (160, 160, 170)
# How often the counts of a flood of bad requests may be due, seconds.
_TICK_S: Final = 1.0
# A page that cannot be drawn so many times in a row has a defect, and is not drawn again.
_FAILURES: Final = 30


class _Server(viser.ViserServer):
    """viser's server, with another light."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        # Without a graphics card, a browser needs some five seconds to compute the reflections of
        # viser's default surroundings, each time a page opens.
        self.scene.configure_environment_map(None)
        self.scene.add_light_hemisphere('/sky', sky_color=_SKY, ground_color=_FLOOR, intensity=2.0)

    def request_share_url(self, verbose: bool = True) -> None:
        """Do not open a tunnel to a public address, which any page could request."""


_Answer = Callable[[Any, Request], Response | None | Awaitable[Response | None]]


@contextlib.contextmanager
def _guarded_by(access: Access, logger: RequestLogger) -> Iterator[None]:
    """
    Make a server that viser starts inside this context check each request.

    viser has no hook for such a check, but the library websockets, which it uses, has one.

    :raises RuntimeError: this version of viser does not start its server with websockets.
    """
    serve, guarded = websockets_server.serve, []

    def serve_guarded(handler: Any, *arguments: Any, process_request: _Answer, **options: Any
                      ) -> Any:
        guarded.append(handler)
        return serve(handler, *arguments, **{
            **options, 'logger': logger,
            'process_request': _checked(access, process_request, logger)})

    with mock.patch.object(websockets_server, 'serve', serve_guarded):
        yield
    if not guarded:
        raise RuntimeError(f'viser {viser.__version__} cannot check who opens the page')


def _checked(access: Access, answer: _Answer, logger: RequestLogger
             ) -> Callable[[Any, Request], Awaitable[Response | None]]:
    """Return a handler that refuses requests without access, and else answers as viser does."""
    async def checked(connection: Any, request: Request) -> Response | None:
        # The loop is viser's own, and this is the first code here that runs in it.
        asyncio.get_running_loop().set_exception_handler(logger.handle_error)
        headers, path = request.headers.get_all, request.path
        refusal = access.refusal(headers, path)
        if refusal:
            return Response(HTTPStatus.FORBIDDEN, 'Forbidden', Headers(
                {'Content-Type': 'text/plain; charset=utf-8', 'Connection': 'close'}),
                f'{refusal}\n'.encode())
        given = answer(connection, request)
        response = await given if inspect.isawaitable(given) else given
        cookie = access.cookie(headers, path)
        if response is not None and cookie:
            response.headers['Set-Cookie'] = cookie
        return response

    return checked


class Serving:
    """
    A server of pages and a thread that draws them. A context manager.

    While no page is open, the thread only wakes once a second, for the counts of its log.
    """

    def __init__(self, subject: Subject, host: str, port: int, title: str,
                 token: str = '') -> None:
        """
        Start the server.

        :param subject: what the pages show.
        :param host: the address to listen on.
        :param port: the first port to try. If it is taken, the next ones are tried.
        :param title: of the pages.
        :param token: a secret that the address must contain, as ``url`` does; '': none.
        :raises OSError: the host is not an address of this machine, or no port is free.
        """
        self._subject = subject
        # Each page, and the time of its last picture on the monotonic clock.
        self._pages: dict[int, tuple[Page, float]] = {}
        self._failures: dict[int, int] = {}
        self._changed = threading.Condition()
        self._ended = False
        # viser warns of pictures for a page that was closed a moment ago. They are harmless.
        warnings.filterwarnings('ignore', 'Queued a .* on a closed connection', UserWarning)
        self._token = token
        # viser prints a banner.
        self._log = FailureLog(print_line)
        with contextlib.redirect_stdout(io.StringIO()), _guarded_by(
                Access(host, token), RequestLogger(self._log)):
            self._server = _Server(host=host, port=port, label=title, verbose=False)
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)
        # A daemon, so that the process also ends if a second Ctrl-C interrupts __exit__.
        self._thread = threading.Thread(target=self._draw, name='pages', daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Return the address of the pages."""
        host = self._server.get_host()
        address = f'http://{"localhost" if host == "0.0.0.0" else host}:{self._server.get_port()}'
        return f'{address}/?token={self._token}' if self._token else address

    def wait_until_closed(self) -> None:
        """Wait until no page is open."""
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

    def _open(self, client: viser.ClientHandle) -> None:
        wake_only_in_loop(client)
        page = Page(client, self._subject, self._log)
        with self._changed:
            # The page may have been closed in the meantime.
            if client.client_id in self._server.get_clients():
                self._pages[client.client_id] = page, time.monotonic()
                self._changed.notify_all()

    def _close(self, client: viser.ClientHandle) -> None:
        with self._changed:
            page, _ = self._pages.pop(client.client_id, (None, 0.0))
            self._changed.notify_all()
        if page is not None:
            page.close()

    def _draw(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or self._pages, _TICK_S)
                if self._ended:
                    return
                pages = dict(self._pages)
            begun = time.monotonic()
            for number, (page, last) in pages.items():
                self._draw_one(number, page, begun - last)
                with self._changed:
                    if number in self._pages:
                        self._pages[number] = page, begun
            self._log.write_counts()
            with self._changed:
                rest = begun + 1.0 / RATE_HZ - time.monotonic()
                self._changed.wait_for(lambda: self._ended, max(rest, 0.0))

    def _draw_one(self, number: int, page: Page, seconds: float) -> None:
        """Draw a page. An error of one page does not stop the others."""
        try:
            page.tick(seconds)
            self._failures.pop(number, None)
        except Exception:  # noqa: B902 - a defect, unless the page was closed in the meantime
            failures = self._failures[number] = self._failures.get(number, 0) + 1
            is_open = number in self._server.get_clients()
            if is_open and failures == 1:
                self._log.report('a page')
            if not is_open or failures >= _FAILURES:
                self._failures.pop(number)
                with self._changed:
                    self._pages.pop(number, None)
