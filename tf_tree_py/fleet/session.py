# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sessions of Zenoh that accept no connections from other machines unless configured to.

At the end of a program Python waits for the calls of Zenoh in daemon threads. Python stops a
daemon thread where it next needs the interpreter. Zenoh is Rust, which does not allow a thread to
be stopped while it returns, so it aborts the process ("FATAL: exception not rethrown"). Python
3.14 does not stop such threads, it leaves them waiting.
"""

import atexit
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
import importlib
import json
import os
from pathlib import Path
import threading
import time
from types import ModuleType
from typing import cast, TYPE_CHECKING

from .certificates import explain

if TYPE_CHECKING:
    import zenoh


class FleetError(Exception):
    """
    A fleet cannot be received or served as requested; the text is one sentence.

    Programs print it and end with the status 2.
    """


def sentence(error: Exception) -> str:
    """Return the text of an error of Zenoh in one line, without source locations."""
    return ' '.join(str(error).partition(' at /')[0].split())


# --- the end of a program

# How long the end of a program waits for calls. An attempt to connect may last half a second
# longer than ``close()`` of a listener waits for it.
END_S = 1.5
_POLL_S = 0.005

# The threads in a call; a nested call counts again. There is no lock, because a process that forks
# could copy it while it is locked. The methods of lists are atomic.
_calling: list[threading.Thread] = []
_ending: list[threading.Thread] = []


@contextmanager
def zenoh_call() -> Iterator[None]:
    """
    Run calls of Zenoh that the end of the program waits for.

    While the program ends, other threads begin none. They wait here, because leaving their
    functions would release objects of Zenoh, and that calls Zenoh, too.

    :raises SystemExit: the program still has not ended; this ends a thread without a message.
    """
    thread = threading.current_thread()
    nested = thread in _calling
    # First, so that the end of the program sees this thread, or this thread sees the end.
    _calling.append(thread)
    if _ending and thread not in _ending and not nested:
        _calling.remove(thread)
        time.sleep(END_S)
        raise SystemExit
    try:
        yield
    finally:
        _calling.remove(thread)


@atexit.register
def _await_calls() -> None:
    """Wait for other threads. Listeners were created, and so are closed, before that."""
    this = threading.current_thread()
    _ending.append(this)
    end = time.monotonic() + END_S
    # After a fork, threads of the parent are not alive.
    while (any(one is not this and one.is_alive() for one in tuple(_calling))
           and time.monotonic() < end):
        time.sleep(_POLL_S)


# --- sessions

Connect = str | Collection[str]
PathLike = str | os.PathLike[str]

# How long closing waits for Zenoh, which may need twenty seconds while a router hangs. Two seconds
# are promised.
CLOSE_S = 1.5
# The limit of an attempt to connect, which cannot be interrupted; five round trips have to fit,
# over the Internet, too.
ATTEMPT_S = 2.0

# The settings of a session where a configuration file has none. A client listens nowhere; a peer
# or a router, which a file may select, listens on this machine only.
_CAREFUL = {
    'mode': 'client',
    'scouting/multicast/enabled': False,
    'scouting/gossip/enabled': False,
    # A cache needs the timestamps to find the messages that are too old for a request.
    'timestamping/enabled': True,
    'connect/retry': {'period_init_ms': 500, 'period_max_ms': 1000, 'period_increase_factor': 2},
}
# A sender on this machine would have its memory mapped into this process, which keeps it after the
# sender has gone; and the sender could change a message while it is read.
_SHARED_MEMORY = 'transport/shared_memory/enabled'
_LISTEN = 'listen/endpoints'
_LARGEST = 'transport/link/rx/max_message_size'
_OPEN = 'transport/unicast/open_timeout'
_LISTEN_HERE = {'router': ['tcp/127.0.0.1:7447'], 'peer': ['tcp/127.0.0.1:0']}
# Protocols whose addresses have to have a port.
_WITH_PORT = ('tcp', 'tls', 'udp', 'quic', 'ws')


def one_or_several(value: str | Collection[str]) -> list[str]:
    """Return an argument that may be one value or several as a list."""
    if isinstance(value, str | bytes) or not isinstance(value, Collection):
        return [value]
    return list(value)


def needs_zenoh(module: str = 'zenoh') -> ModuleType:
    """
    Import and return a module of Zenoh.

    :raises FleetError: it is not installed; the error names the package to install.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or '').partition('.')[0] != 'zenoh':
            raise
        raise FleetError('a fleet needs eclipse-zenoh, which is not installed: '
                         'pip install eclipse-zenoh') from error


def configuration(connect: Connect | None = None, config: PathLike | None = None
                  ) -> 'zenoh.Config':
    """
    Return the configuration of a session.

    Without a file the session is a client: it connects, and listens nowhere.

    :param connect: the router, such as ``tcp/hall:7447``, or several; None: that of the file.
    :param config: a configuration file of Zenoh (JSON5): TLS, user and password, and all other
        settings; those that it leaves out get safe values.
    :raises FleetError: an invalid address, a missing or invalid file, or no address at all.
    """
    made = needs_zenoh().Config() if config is None else _from_file(Path(config))
    for key, value in _CAREFUL.items():
        if made.get_json(key) == 'null':
            made.insert_json5(key, json.dumps(value))
    _set_unless_changed(made, _LISTEN, _LISTEN_HERE)
    _set_unless_changed(made, _SHARED_MEMORY, False)
    _set_unless_changed(made, _OPEN, round(1000 * ATTEMPT_S))
    if connect is not None:
        _connect(made, one_or_several(connect))
    if made.get_json('connect/endpoints') == '[]' and made.get_json('mode') == '"client"':
        raise FleetError("nothing to connect to: pass the router, such as 'tcp/hall:7447', or a "
                         'configuration file with connect/endpoints')
    return made


def endpoints_of(config: 'zenoh.Config') -> list[str]:
    """Return the endpoints that a configuration connects to."""
    endpoints = json.loads(config.get_json('connect/endpoints'))
    if isinstance(endpoints, dict):  # by mode
        endpoints = [one for some in endpoints.values() for one in some]
    return [str(endpoint) for endpoint in endpoints]


def refuse_larger(config: 'zenoh.Config', size: int) -> None:
    """Make a session drop messages of more bytes unread, unless a file has set that."""
    _set_unless_changed(config, _LARGEST, size)


def open_session(config: 'zenoh.Config', timeout_s: float | None = None) -> 'zenoh.Session':
    """
    Return a connected session; afterwards it reconnects by itself. ``close_session`` closes it.

    :param config: see ``configuration``.
    :param timeout_s: how long to try; None: the value of the configuration.
    :raises FleetError: there is no connection; the error has the reason, if it can be found.
    """
    try:
        return try_session(config, timeout_s)
    except FleetError as error:
        why = why_no_session(config)
        raise FleetError(f'{error}: {why}' if why else str(error)) from error


def try_session(config: 'zenoh.Config', timeout_s: float | None = None) -> 'zenoh.Session':
    """
    Return a session as ``open_session`` does; it does not search for the reason of a failure.

    :raises FleetError: there is no connection.
    """
    library = needs_zenoh()
    library.try_init_log_from_env()
    if timeout_s is not None:
        config.insert_json5('connect/timeout_ms', str(max(1, round(1000 * timeout_s))))
    try:
        with zenoh_call():
            return cast('zenoh.Session', library.open(config))
    except library.ZError as error:
        raise FleetError(sentence(error)) from error


def why_no_session(config: 'zenoh.Config') -> str:
    """Return why there is no session, if it can be found, or ''; it takes a second."""
    return explain(config, endpoints_of(config))


def close_session(session: 'zenoh.Session') -> None:
    """
    Close a session within two seconds; if the router hangs, the rest happens in the background.

    Its own ``close()`` may need twenty seconds then, and raise an error.
    """
    end_soon(session.close)


def end_soon(*works: Callable[[], object]) -> None:
    """
    Do work that may hang, for ``CLOSE_S`` at most; the rest of it happens in the background.

    Errors of Zenoh are ignored: they mean that it could not inform the router.
    """
    def do_all() -> None:
        with zenoh_call():
            for work in works:
                with suppress(needs_zenoh().ZError):
                    work()

    thread = threading.Thread(target=do_all, name='fleet end', daemon=True)
    try:
        thread.start()
    except RuntimeError:  # the program ends, and starts no thread any more
        do_all()
    else:
        thread.join(CLOSE_S)


def _set_unless_changed(config: 'zenoh.Config', key: str, value: object) -> None:
    """Set a value that a file has left at Zenoh's default."""
    if config.get_json(key) == needs_zenoh().Config().get_json(key):
        config.insert_json5(key, json.dumps(value))


def _from_file(path: Path) -> 'zenoh.Config':
    library = needs_zenoh()
    if not path.is_file():
        raise FleetError(f'{path}: there is no such configuration file')
    try:
        return cast('zenoh.Config', library.Config.from_file(path))
    except library.ZError as error:
        raise FleetError(f'{path} is not a Zenoh configuration: {sentence(error)}') from error


def _connect(config: 'zenoh.Config', endpoints: Sequence[str]) -> None:
    for endpoint in endpoints:
        protocol, slash, address = str(endpoint).partition('/')
        host, _, port = address.partition('?')[0].partition('#')[0].rpartition(':')
        if not slash or protocol in _WITH_PORT and not (host and port.isdecimal()):
            raise FleetError(f'{endpoint!r} is not the address of a router, such as tcp/hall:7447')
    try:
        config.insert_json5('connect/endpoints', json.dumps(endpoints))
    except needs_zenoh().ZError as error:
        raise FleetError(f'{endpoints} are not addresses of routers, such as tcp/hall:7447: '
                         f'{sentence(error)}') from error
