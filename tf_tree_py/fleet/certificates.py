# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The reason why a session is refused, as far as this machine can find it.

Zenoh reports only a timeout. Therefore its files are checked here: they exist, the key matches,
the dates are valid, and the authority has signed. If all are right, a TLS handshake with the
router follows. Nothing but the handshake is sent.
"""

from contextlib import suppress
from datetime import datetime, timezone
import json
from pathlib import Path
import socket
import ssl
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    import zenoh

_SETTINGS = 'transport/link/tls'
_AUTHORITY = 'root_ca_certificate'
# The settings of each certificate and its key.
_PAIRS = (('connect_certificate', 'connect_private_key'),
          ('listen_certificate', 'listen_private_key'))
# Enough messages for each side of TLS to refuse the other.
_MOST_STEPS = 10
_PROBE_S = 1.0
_MOST_PROBES = 2

Settings = dict[str, Any]


def explain(config: 'zenoh.Config', endpoints: list[str]) -> str:
    """
    Return why no session can be made, in a sentence without a full stop; '' if no reason is found.

    It may take a second for each of the first two endpoints.
    """
    settings = json.loads(config.get_json(_SETTINGS)) or {}
    problem = _fault_of_files(settings)
    for endpoint in endpoints[:_MOST_PROBES]:
        problem = problem or _refusal(endpoint, settings)
    return problem


# --- the files

def _fault_of_files(settings: Settings) -> str:
    """
    Return the fault of the files that ``transport/link/tls`` names, or ''.

    :param settings: as in Zenoh's configuration.
    """
    named = [(name, settings[name]) for name in (_AUTHORITY, *sum(_PAIRS, ()))
             if settings.get(name)]
    for name, path in named:
        try:
            Path(path).read_bytes()
        except OSError as error:
            return f'{Path(path).absolute()} cannot be read ({name}): {error.strerror}'
    for certificate, key in _PAIRS:
        if settings.get(certificate) and settings.get(key):
            problem = _fault_of_pair(settings.get(_AUTHORITY), settings[certificate],
                                     settings[key])
            if problem:
                return problem
    return ''


def _fault_of_pair(authority: str | None, certificate: str, key: str) -> str:
    """Return why a peer that trusts the same authority would refuse a certificate, or ''."""
    server, client = _context(ssl.PROTOCOL_TLS_SERVER), _context(ssl.PROTOCOL_TLS_CLIENT)
    for context in (server, client):
        try:
            # An empty password: without one, OpenSSL asks for it on the terminal.
            context.load_cert_chain(certificate, key, password='')
        except ssl.SSLError as error:
            if error.reason == 'KEY_VALUES_MISMATCH':
                return f'{key} is not the private key of the certificate {certificate}'
            return (f'{certificate} and {key} are not a certificate and its private key in PEM '
                    'format')
    if authority is None:
        return ''
    try:
        server.load_verify_locations(authority)
    except ssl.SSLError:
        return f'{authority} is not the certificate of an authority in PEM format ({_AUTHORITY})'
    server.verify_mode = ssl.CERT_REQUIRED
    try:
        _shake_hands(server, client)
    except ssl.SSLCertVerificationError as error:
        return f'{certificate} is refused: {_in_words(error, authority)}'
    return ''


def _context(protocol: int) -> ssl.SSLContext:
    context = ssl.SSLContext(protocol)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context


def _shake_hands(server: ssl.SSLContext, client: ssl.SSLContext) -> None:
    """Connect two sides in this process; the side that refuses the other raises."""
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    sides = (client.wrap_bio(to_client, to_server),
             server.wrap_bio(to_server, to_client, server_side=True))
    for _ in range(_MOST_STEPS):
        for side in sides:
            with suppress(ssl.SSLWantReadError):
                side.do_handshake()


def _in_words(error: ssl.SSLCertVerificationError, authority: str | None) -> str:
    clock = datetime.now(timezone.utc)
    message = error.verify_message
    if 'issuer' in message or 'self-signed' in message:
        signer = f'the authority in {authority}' if authority else "one of this system's"
        return f'it is not signed by {signer} ({message})'
    if 'expired' in message or 'not yet valid' in message:
        return f'{message}, by the clock of this machine ({clock:%Y-%m-%d %H:%M} UTC)'
    return message


# --- the router

def _refusal(endpoint: str, settings: Settings) -> str:
    """Return why a router refuses connections, or ''; nothing but a TLS handshake is sent."""
    protocol, _, address = endpoint.partition('/')
    host, _, port = address.partition('?')[0].partition('#')[0].rpartition(':')
    if protocol not in ('tcp', 'tls') or not port.isdecimal():
        return ''
    host = host.strip('[]')
    try:
        with socket.create_connection((host, int(port)), _PROBE_S) as connection:
            return (_refusal_by_tls(connection, host, settings) if protocol == 'tls' else
                    f'{host}:{port} accepts connections, but starts no session: it may not be a '
                    'router, or may require tls/ instead of tcp/, or a user and a password')
    except socket.gaierror:
        return f'no address is known for the host {host!r}'
    except TimeoutError:
        return f'{host}:{port} does not answer'
    except OSError as error:
        return f'{host}:{port} cannot be reached: {error.strerror or error}'


def _refusal_by_tls(connection: socket.socket, host: str, settings: Settings) -> str:
    context = ssl.create_default_context(cafile=settings.get(_AUTHORITY))
    context.check_hostname = settings.get('verify_name_on_connect') is not False
    certificate, key = (settings.get(name) for name in _PAIRS[0])
    if certificate and key:
        context.load_cert_chain(certificate, key, password='')
    try:
        secured = context.wrap_socket(connection, server_hostname=host)
    except TimeoutError:
        return f'the server at {host} does not use TLS: use tcp/ instead of tls/'
    except ssl.SSLCertVerificationError as error:
        return (f'this machine refuses the certificate of the router at {host}: '
                f'{_in_words(error, settings.get(_AUTHORITY))}')
    except ssl.SSLError as error:
        return _alert(host, str(error.reason or error), bool(certificate))
    with secured:
        try:
            # By now this side has accepted. A router that refuses sends an alert; otherwise it
            # waits.
            if secured.recv(1):
                return ''
        except ssl.SSLError as error:
            return _alert(host, str(error.reason or error), bool(certificate))
        except TimeoutError:
            return (f'the TLS connection to {host} works, but no session starts: the router may '
                    'require a user and a password')
    return f'the router at {host} closes the connection without a reason'


def _alert(host: str, reason: str, has_certificate: bool) -> str:
    """Return in words why the other side has ended a handshake."""
    if 'WRONG_VERSION_NUMBER' in reason or 'RECORD_LAYER_FAILURE' in reason:
        return f'the server at {host} does not use TLS: use tcp/ instead of tls/'
    if 'CERTIFICATE_REQUIRED' in reason or not has_certificate:
        return (f'the router at {host} requires a client certificate: set '
                f'{_SETTINGS}/{_PAIRS[0][0]} and {_PAIRS[0][1]}')
    words = reason.partition('ALERT_')[2].replace('_', ' ').lower() or reason
    return f"the router at {host} refuses this machine's certificate: {words}"
