# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Hostile robots of a fleet: ``python -m benchmark.processes.fleet_hostile ROUTER``.

Each attack is a separate robot in a separate thread, and continues until the process ends.
"""

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timezone
import itertools
import os
import sys
import threading
import time

from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import configuration, open_session
from tf_tree_py.fleet.keys import rmw_key_of, RMW_TYPE, Topic, TYPE_HASH
import zenoh

from ..worker import serve

# The pause between two steps of an attack, seconds.
_PAUSE_S = 0.02
_TOKENS = 500

Attack = Callable[[zenoh.Session, str], Iterator[None]]


def _message(edges: int, name: str) -> bytes:
    return write([Sample(f'p{name}_{edge}', f'c{name}_{edge}', time.time_ns(), IDENTITY)
                  for edge in range(edges)])


def large(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Send messages of 1 MB with new frame names."""
    messages = [_message(9_000, f'{number}') for number in range(8)]
    for data in itertools.cycle(messages):
        session.put(f'{robot}/tf', data)
        yield


def names(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Send an endless series of new names, in messages of a permitted size."""
    for number in itertools.count():
        session.put(f'{robot}/tf', _message(200, f'{number}'))
        yield


def flood(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Send small messages as fast as possible."""
    while True:
        data = write([Sample('map', 'base', time.time_ns(), IDENTITY)])
        for _ in range(200):
            session.put(f'{robot}/tf', data)
        yield


def garbage(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Send bytes that are not a message."""
    while True:
        session.put(f'{robot}/tf_static', os.urandom(2_000))
        yield


def clock(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Send with the clock of a machine whose clock battery is empty."""
    while True:
        stamp = zenoh.Timestamp(datetime.fromtimestamp(5, timezone.utc),
                                session.new_timestamp().get_id())
        session.put(f'{robot}/tf', write([Sample('map', 'base', 5 * 10**9, IDENTITY)]),
                    timestamp=stamp)
        yield


def keys(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Write under keys below its own name that resemble those of other robots."""
    data = write([Sample('map', 'link_0', 2**60, IDENTITY)])
    for number in itertools.count():
        session.put(f'{robot}/robot0/tf/{RMW_TYPE}/{TYPE_HASH}', data)
        session.put(f'{robot}/{number:_>500}/tf/{RMW_TYPE}/{number}', data)
        session.put(rmw_key_of(Topic(robot, False), number % 200, f'{number}'), data)
        yield


def tokens(session: zenoh.Session, robot: str) -> Iterator[None]:
    """Appear and disappear as many publishers of static transforms, and never answer queries."""
    asked: list[zenoh.Query] = []
    cache = session.declare_queryable(f'{session.zid()}/**', asked.append)
    declared: list[zenoh.LivelinessToken] = []
    for number in itertools.count():
        declared.append(session.liveliness().declare_token(
            f'@ros2_lv/0/{session.zid()}/{number}/10/MP/%/%/driver/%{robot}%tf_static/'
            f'{RMW_TYPE}/RIHS01_{number}/::,1:,:,:,,'))
        if len(declared) > _TOKENS:
            declared.pop(0).undeclare()
            asked.clear()
        yield
    cache.undeclare()


ATTACKS: tuple[Attack, ...] = (large, names, flood, garbage, clock, keys, tokens)


def attack(session: zenoh.Session, names: Sequence[str]) -> None:
    """Start the named attacks, or all."""
    for one in ATTACKS:
        if names and one.__name__ not in names:
            continue
        threading.Thread(target=_go_on, args=(session, one), daemon=True).start()


def _go_on(session: zenoh.Session, one: Attack) -> None:
    for _ in one(session, f'evil_{one.__name__}'):
        time.sleep(_PAUSE_S)


if __name__ == '__main__':
    with open_session(configuration(sys.argv[1]), 10.0) as session:
        serve({'attack': lambda names: attack(session, names)})
