# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Which requests the server of the pages accepts.

Any website that is open in a browser on this machine can send requests to this server, so the
IP address of a request proves nothing. Its headers do, because a website cannot choose them:
``Origin`` is the website's own address, and ``Host`` is the name under which the browser found
this server. After DNS rebinding, that is a foreign name.
"""

from collections.abc import Callable, Sequence
from hmac import compare_digest
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
import socket
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

Headers = Callable[[str], Sequence[str]]
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

    def refusal(self, headers: Headers, path: str) -> str:
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

    def cookie(self, headers: Headers, path: str) -> str:
        """Return the cookie for the response to a request; '' if none is needed."""
        if not self._has_token(path):
            return ''
        # Browsers send cookies to all ports of a host, so the name contains the port.
        _, port = _place(f'http://{_only(headers("Host"))}') or ('', 0)
        return f'tf_view_{port}={self.token}; Path=/; HttpOnly; SameSite=Strict'

    def _knows_token(self, headers: Headers, path: str) -> bool:
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
