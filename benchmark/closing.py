# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How long closing a fleet's connections takes, for each state of the router.

``python -m benchmark.closing`` starts a program for each end of a connection and each state. It
measures ``close()``, the longest pause of another thread of the program meanwhile, and the time
until the program has ended after that. The router of each state is this process: it is killed, it
hangs (SIGSTOP), or it hangs and continues (SIGCONT) when ``close()`` has returned.
"""

import argparse
from collections.abc import Callable
from contextlib import suppress
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import Any

from tf_tree_py.fleet import (
    close_session,
    configuration,
    FleetError,
    FleetListener,
    open_session,
    RobotPublisher,
)
from tf_tree_py.fleet.connection import Uplink

from .counting_link import free_port
from .worker import Worker

_ENDPOINTS = ('listener', 'uplink', 'publisher', 'session')
_STATES = ('answers', 'killed', 'hangs', 'hangs, continues', 'hangs, link full',
           'hangs, static waits', 'hangs on its return', 'hangs from the start')
_SETTLE_S = 2.0
_LARGE = bytes(100_000)
# A session without a reference ends.
_sessions: list[Any] = []


# --- the program

class _Pauses(threading.Thread):
    """Measures the longest time for which a thread cannot run."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.longest = 0.0
        self.start()

    def run(self) -> None:
        """Sleep again and again."""
        while True:
            before = time.monotonic()
            time.sleep(0.01)
            self.longest = max(self.longest, time.monotonic() - before)


def _begin(endpoint: str, address: str) -> tuple[Callable[[], object], Callable[[bool], object]]:
    """Open a connection; return how to close it, and how to send a large message over it."""
    if endpoint == 'listener':
        return FleetListener(address).close, lambda static: None
    if endpoint == 'uplink':
        uplink = Uplink(address, 'robot7')
        return uplink.close, lambda static: _send(uplink._publisher, static)
    with suppress(FleetError):
        session = open_session(configuration(address), 2 * _SETTLE_S)
        _sessions.append(session)
        robot = RobotPublisher(session, 'robot7')
        return (robot.close if endpoint == 'publisher' else lambda: close_session(session),
                lambda static: _send(robot, static))
    return lambda: None, lambda static: None


def _send(publisher: RobotPublisher | None, static: bool) -> None:
    if publisher is None:  # it has no connection now
        return
    send = publisher.send_static if static else publisher.send
    send(_LARGE)


def _send_for_ever(send: Callable[[bool], object]) -> None:
    with suppress(Exception):
        while True:
            send(True)


def program(endpoint: str, state: str, address: str) -> None:
    """Open a connection, wait for the state of the router, and close it."""
    pauses = _Pauses()
    close, send = _begin(endpoint, address)
    print('open', flush=True)
    sys.stdin.readline()
    if state == 'hangs, link full':
        end = time.monotonic() + _SETTLE_S
        while time.monotonic() < end:
            send(False)
            time.sleep(0.001)
    if state == 'hangs, static waits':
        threading.Thread(target=_send_for_ever, args=(send,), daemon=True).start()
        time.sleep(_SETTLE_S)
    pauses.longest, begin = 0.0, time.monotonic()
    close()
    print(time.monotonic() - begin, pauses.longest, flush=True)
    sys.stdin.readline()
    if endpoint == 'publisher':
        close_session(_sessions[0])


# --- the measurement

def measure(endpoint: str, state: str) -> tuple[float, float, float, int]:
    """Return the times of closing, of the longest pause and of the end, and the exit status."""
    address, server = f'tcp/127.0.0.1:{free_port()}', None
    router: Worker | None = _router(address)
    # Another listener, so that the robot's messages are sent at all.
    other = _child('listener', 'answers', address)
    assert router is not None
    if state == 'hangs from the start':
        os.kill(router.pid, signal.SIGSTOP)
    one = _child(endpoint, state, address)
    time.sleep(_SETTLE_S)
    if state.startswith('hangs') and state != 'hangs on its return':
        os.kill(router.pid, signal.SIGSTOP)
    elif state != 'answers':
        router.kill()
        router = None
        if state == 'hangs on its return':
            server = socket.create_server(('127.0.0.1', int(address.rpartition(':')[2])))
        time.sleep(_SETTLE_S)
    closing_s, pause_s = map(float, _ask(one, 'close').split())
    begin = time.monotonic()
    if state == 'hangs, continues' and router is not None:
        os.kill(router.pid, signal.SIGCONT)
    one.communicate('end\n')
    end_s = time.monotonic() - begin
    if router is not None:
        os.kill(router.pid, signal.SIGKILL)
        router.close()
    if server is not None:
        server.close()
    other.kill()
    other.communicate()
    return closing_s, pause_s, end_s, one.returncode


def _router(address: str) -> Worker:
    router = Worker([sys.executable, '-m', 'benchmark.processes.fleet_router', address])
    router.call('is_up')
    return router


def _child(*arguments: str) -> Any:
    child = subprocess.Popen(
        [sys.executable, '-m', 'benchmark.closing', '--program', *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    child.stdout.readline()
    return child


def _ask(child: Any, line: str) -> str:
    child.stdin.write(line + '\n')
    child.stdin.flush()
    return str(child.stdout.readline())


def main() -> int:
    """Parse the arguments and run it."""
    parser = argparse.ArgumentParser(prog='python -m benchmark.closing', description=__doc__)
    parser.add_argument('--program', nargs=3, help=argparse.SUPPRESS)
    parser.add_argument('--kinds', nargs='+', choices=_ENDPOINTS, default=_ENDPOINTS)
    parser.add_argument('--states', nargs='+', choices=_STATES, default=_STATES)
    options = parser.parse_args()
    if options.program:
        program(*options.program)
        return 0
    worst = 0.0
    for state in options.states:
        for endpoint in options.kinds:
            closing_s, pause_s, end_s, status = measure(endpoint, state)
            worst = max(worst, closing_s)
            print(f'{state:<22}{endpoint:<11}close {closing_s:5.2f} s   '
                  f'longest pause {pause_s:5.2f} s   end {end_s:5.2f} s   status {status}',
                  flush=True)
    return 0 if worst <= 2.0 else 1


if __name__ == '__main__':
    sys.exit(main())
