# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Soak test: honest and hostile robots, routers that die, pages that never read.

``python -m benchmark.soak`` runs for five minutes and ``--minutes 60`` for an hour. Memory,
threads and descriptors of a listener and of a ``tf_view`` must level off. The data of honest
robots must arrive within a second, whenever there is a router. A process with a plain
subscription to the honest robots measures at the same moments. Where its newest pose is old too,
the machine is too busy to send or to route.
"""

import argparse
from bisect import bisect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, ExitStack
import logging
import os
import subprocess
import sys
import tempfile
import time
from typing import Any, NamedTuple

from tf_tree_py.core import TransformException
from tf_tree_py.fleet import FleetListener
from tf_tree_py.recording.flight_recorder import FlightRecorder

from .counting_link import free_port
from .processes.fleet_hostile import ATTACKS
from .processes.fleet_robots import MOVING
from .resources import levels_off, Use, use_of
from .unread import unread_pages
from .worker import Worker

_HONEST, _RATE_HZ = 5, 10.0
_LOOK_S, _LINE_S = 0.1, 10.0
# How long a router runs; how long there is none; how long robots and the listener may take to
# find the next one, for which they search every second.
_LIFE_S, _GAP_S, _RETURN_S = 60.0, 2.0, 10.0
_ANSWER_S = 1.0
_PAGES = 3


def start(process: str, *arguments: str) -> Worker:
    """Start one of ``processes`` in this Python, which needs no ROS."""
    return Worker([sys.executable, '-m', f'benchmark.processes.{process}', *arguments])


class Look(NamedTuple):
    """
    The age of the oldest of the robots' newest poses.

    :ivar at: seconds of the monotonic clock.
    :ivar age: seconds; ``plain`` is the same in the plain subscription at about that time.
    """

    at: float
    age: float
    plain: float = 0.0


class Ages:
    """Repeated measurements of the age of each honest robot's newest pose."""

    def __init__(self, listener: FleetListener) -> None:
        self._listener = listener
        self.looks: list[Look] = []

    def look(self) -> None:
        """Record the age of the oldest of all newest poses."""
        worst = 0.0
        for number in range(_HONEST):
            try:
                newest = self._listener.buffer.latest_common_time(
                    'map', f'robot{number}/link_{MOVING - 1}')
            except TransformException:
                if not self.looks:  # its first pose has not arrived yet
                    return
                newest = 0
            worst = max(worst, (time.time_ns() - newest) * 1e-9)
        self.looks.append(Look(time.monotonic(), worst))

    def beside(self, plain: Sequence[tuple[float, float]]) -> list[Look]:
        """
        Return all looks, each with the age in the plain subscription at about that time.

        :param plain: time and age of each of its looks.
        """
        times = [at for at, _ in plain]
        return [look._replace(plain=max(
            (age for _, age in plain[max(0, place - 1):place + 1]), default=0.0))
            for look in self.looks for place in [bisect(times, look.at)]]


class Router:
    """A router that is killed periodically."""

    def __init__(self) -> None:
        self.address = f'tcp/127.0.0.1:{free_port()}'
        self.deaths = 0
        self._worker: Worker | None = None
        self._change = 0.0
        self._up_since = 0.0
        self.turn()

    @property
    def settled(self) -> bool:
        """Return whether the router has run long enough for all processes to find it."""
        return self._worker is not None and time.monotonic() > self._up_since + _RETURN_S

    def turn(self) -> None:
        """Stop or restart the router, if it is time."""
        now = time.monotonic()
        if now < self._change:
            return
        if self._worker is None:
            self._worker = start('fleet_router', self.address)
            self._worker.call('is_up')
            self._up_since, self._change = time.monotonic(), time.monotonic() + _LIFE_S
        else:
            self.close()
            self.deaths += 1
            self._change = now + _GAP_S

    def close(self) -> None:
        """Kill the router at once."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None


@contextmanager
def page(address: str) -> Iterator[tuple[int, list[Any]]]:
    """Run a ``tf_view`` with pages that never read; yield the id of its process."""
    port = free_port()
    view = subprocess.Popen([sys.executable, '-m', 'tf_tree_py.view.tf_view', '--fleet', address,
                             '--port', str(port)], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    try:
        yield view.pid, unread_pages(port, _PAGES)
    finally:
        view.terminate()
        view.wait()


def soak(minutes: float, attacks: Sequence[str]) -> bool:
    """
    Run everything for a number of minutes; return whether all requirements are met.

    :param attacks: their names; none: all.
    """
    with ExitStack() as closing, tempfile.TemporaryDirectory() as folder:
        router = Router()
        closing.callback(router.close)
        robots = closing.enter_context(start('fleet_robots', router.address))
        hostile = closing.enter_context(start('fleet_hostile', router.address))
        os.setpriority(os.PRIO_PROCESS, hostile.pid, 10)
        reference = closing.enter_context(
            start('fleet_reference', router.address, 'robot$*/tf'))
        listener = closing.enter_context(
            FleetListener(router.address, observers=[FlightRecorder(folder)]))
        view, pages = closing.enter_context(page(router.address))
        print(f'{_HONEST} honest robots, hostile ones, {len(pages)} pages that never read, a '
              f'router that dies every {_LIFE_S:g} s; for {minutes:g} minutes', flush=True)
        robots.begin('drive', count=_HONEST, rate_hz=_RATE_HZ, seconds=60 * minutes + 60)
        hostile.call('attack', names=list(attacks))
        well = _watch(listener, reference, router, view, 60 * minutes)
        for robot in listener.robots():
            print(f'  {robot.name}: {robot.transforms} taken, {robot.refused} refused, '
                  f'{robot.dropped} dropped, {robot.frames} frames; '
                  f'{robot.limit or "no limit met"}')
        robots.kill()
        hostile.kill()
        return well


def _watch(listener: FleetListener, reference: Worker, router: Router, view: int,
           seconds: float) -> bool:
    ages, uses = Ages(listener), {'listener': list[Use](), 'tf_view': list[Use]()}
    plain = list[tuple[float, float]]()
    begin = line = time.monotonic()
    while time.monotonic() < begin + seconds:
        router.turn()
        if router.settled:
            ages.look()
        for name, pid in (('listener', os.getpid()), ('tf_view', view)):
            uses[name].append(use_of(pid))
        if time.monotonic() > line:
            line += _LINE_S
            now = ', '.join(f'{name} {use[-1]}' for name, use in uses.items())
            plain += map(tuple, reference.call('looks'))
            lately = [look for look in ages.beside(plain) if look.at > line - 2 * _LINE_S]
            print(f'{time.monotonic() - begin:5.0f} s: {now}; newest pose at most '
                  f'{max((look.age for look in lately), default=0.0):.2f} s old; in a plain '
                  f'subscription: {max((look.plain for look in lately), default=0.0):.2f} s',
                  flush=True)
        time.sleep(_LOOK_S)
    return _judge(ages.beside(plain), uses, router.deaths)


def _judge(looks: Sequence[Look], uses: dict[str, list[Use]], deaths: int) -> bool:
    """Print the result; return whether all requirements are met."""
    old = [look for look in looks if look.age > _ANSWER_S]
    also = sum(look.plain > _ANSWER_S for look in looks)
    own = sum(look.plain < _ANSWER_S / 2 for look in old)
    ages = sorted(look.age for look in looks)
    print(f'the router died {deaths} times; the newest pose of the worst robot was '
          f'{ages[len(ages) // 2]:.2f} s old (median), {ages[-1]:.2f} s at most, and more than '
          f'{_ANSWER_S:g} s in {len(old)} of {len(looks)} measurements; in a plain '
          f'subscription in {also}. In {own} measurements, only the listener was late')
    return all([not old, *(levels_off(name, use) for name, use in uses.items())])


def main() -> int:
    """Run the soak; return 0 if all requirements are met."""
    parser = argparse.ArgumentParser(prog='python -m benchmark.soak', description=__doc__)
    parser.add_argument('--minutes', type=float, default=5.0, help='default: 5')
    parser.add_argument('--attacks', nargs='*', default=(), choices=[
        one.__name__ for one in ATTACKS], help='default: all')
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.WARNING, format='%(message)s')
    # Hide the repeated reports of robots that send garbage, and of pages that are cut off.
    for name in ('tf_tree_py.fleet.incidents', 'websockets'):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return 0 if soak(arguments.minutes, arguments.attacks) else 1


if __name__ == '__main__':
    sys.exit(main())
