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

"""Sessions of Zenoh that open nothing to the world unless they are told to."""

from collections.abc import Collection, Sequence
import importlib
import json
import os
from pathlib import Path
from typing import Any, cast, TYPE_CHECKING

from .errors import FleetError, sentence

if TYPE_CHECKING:
    import zenoh

Connect = str | Collection[str]
PathLike = str | os.PathLike[str]

# What a session has where a configuration file says nothing else. A client listens nowhere; a
# peer or a router, which a file may ask for, does so on this machine only.
_CAREFUL = {
    'mode': 'client',
    'scouting/multicast/enabled': False,
    'scouting/gossip/enabled': False,
    # A cache tells by them what is too old for whoever asks.
    'timestamping/enabled': True,
    'connect/retry': {'period_init_ms': 500, 'period_max_ms': 4000, 'period_increase_factor': 2},
}
_LISTEN = 'listen/endpoints'
_LISTEN_HERE = {'router': ['tcp/127.0.0.1:7447'], 'peer': ['tcp/127.0.0.1:0']}
# Protocols whose addresses have to have a port.
_WITH_PORT = ('tcp', 'tls', 'udp', 'quic', 'ws')


def one_or_several(value: Any) -> list[Any]:
    """Return what a caller gave, who may give one or several, as a list."""
    several = isinstance(value, Collection) and not isinstance(value, str | bytes)
    return list(value) if several else [value]


def needs_zenoh(module: str = 'zenoh') -> Any:
    """
    Return a module of Zenoh, imported.

    :raises FleetError: it is not installed; the sentence says what to do.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or '').partition('.')[0] != 'zenoh':
            raise
        raise FleetError('a fleet needs eclipse-zenoh, which is not installed: '
                         "pip install 'tf_tree_py[fleet]'") from error


def configuration(connect: Connect | None = None, config: PathLike | None = None
                  ) -> 'zenoh.Config':
    """
    Return the configuration of a session.

    Without a file the session is a client: it connects, and listens nowhere.

    :param connect: the router, such as ``tcp/hall:7447``, or several; None: as the file says.
    :param config: a configuration file of Zenoh (JSON5): TLS, user and password, and whatever
        else; what it leaves open is set carefully.
    :raises FleetError: what is no address or no such file, or no address at all.
    """
    zenoh = needs_zenoh()
    made = zenoh.Config() if config is None else _from_file(Path(config))
    for key, value in _CAREFUL.items():
        if made.get_json(key) == 'null':
            made.insert_json5(key, json.dumps(value))
    if made.get_json(_LISTEN) == zenoh.Config().get_json(_LISTEN):
        made.insert_json5(_LISTEN, json.dumps(_LISTEN_HERE))
    if connect is not None:
        _connect(made, one_or_several(connect))
    if made.get_json('connect/endpoints') == '[]' and made.get_json('mode') == '"client"':
        raise FleetError("nothing to connect to: pass the router, such as 'tcp/hall:7447', or a "
                         'configuration file with connect/endpoints')
    return made


def endpoints_of(config: 'zenoh.Config') -> list[str]:
    """Return what a configuration connects to."""
    endpoints = json.loads(config.get_json('connect/endpoints'))
    if isinstance(endpoints, dict):  # by mode
        endpoints = [one for some in endpoints.values() for one in some]
    return [str(endpoint) for endpoint in endpoints]


def open_session(config: 'zenoh.Config', timeout_s: float | None = None) -> 'zenoh.Session':
    """
    Return a session, connected; once it is, it reconnects by itself.

    Why a connection fails, Zenoh tells no caller: ``RUST_LOG=zenoh=info`` in the environment
    lets it print that.

    :param config: see ``configuration``.
    :param timeout_s: how long to try; None: as the configuration says.
    :raises FleetError: there is no connection.
    """
    library = needs_zenoh()
    library.try_init_log_from_env()
    if timeout_s is not None:
        config.insert_json5('connect/timeout_ms', str(max(1, round(1000 * timeout_s))))
    try:
        return cast('zenoh.Session', library.open(config))
    except library.ZError as error:
        raise FleetError(sentence(error)) from error


def _from_file(path: Path) -> 'zenoh.Config':
    library = needs_zenoh()
    if not path.is_file():
        raise FleetError(f'{path}: there is no such configuration file')
    try:
        return cast('zenoh.Config', library.Config.from_file(path))
    except library.ZError as error:
        raise FleetError(f'{path} is no configuration of Zenoh: {sentence(error)}') from error


def _connect(config: 'zenoh.Config', endpoints: Sequence[str]) -> None:
    for endpoint in endpoints:
        protocol, slash, address = str(endpoint).partition('/')
        host, _, port = address.partition('?')[0].partition('#')[0].rpartition(':')
        if not slash or protocol in _WITH_PORT and not (host and port.isdecimal()):
            raise FleetError(f'{endpoint!r} is no address of a router: it is like tcp/hall:7447')
    try:
        config.insert_json5('connect/endpoints', json.dumps(endpoints))
    except needs_zenoh().ZError as error:
        raise FleetError(f'{endpoints} are no addresses of routers, such as tcp/hall:7447: '
                         f'{sentence(error)}') from error
