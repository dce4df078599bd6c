# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Which messages arrive although the router dies, and how much memory keeping them takes.

``python -m benchmark.outages`` kills a router twenty times in 100 s, at random moments, for 0.05
to 1 s; robots send meanwhile. ``--kills 1 --away 6`` is one outage of six seconds. A program that
keeps the processors busy, ``--load 6``, makes filling a gap slow, so that the router dies during
it more often.
"""

import argparse
from contextlib import closing, ExitStack
import logging
import random
import subprocess
import sys
import time

from tf_tree_py.core import UNLIMITED
from tf_tree_py.fleet import FleetListener

from .counting_link import free_port
from .processes.fleet_numbered import FIRST
from .worker import Worker

_PROCESSES = 3
# The longest time until all robots are connected again, and how long their gaps may take then.
_RETURN_S, _FILL_S = 60.0, 10.0


def start(process: str, *arguments: str) -> Worker:
    """Start one of ``processes`` in this Python, which needs no ROS."""
    return Worker([sys.executable, '-m', f'benchmark.processes.{process}', *arguments])


def router_at(address: str) -> Worker:
    """Start a router, and return it as soon as it listens."""
    router = start('fleet_router', address)
    router.call('is_up')
    return router


def endure(options: argparse.Namespace) -> bool:
    """Run it, print the result, and return whether all messages arrived."""
    draw = random.Random(options.seed)
    address = f'tcp/127.0.0.1:{free_port()}'
    names = [f'robot{number}' for number in range(options.robots)]
    count = int(options.rate * options.seconds)
    with ExitStack() as ending:
        router = router_at(address)
        ending.callback(lambda: router.close())
        listener = ending.enter_context(FleetListener(address, cache_time=UNLIMITED))
        processes = [ending.enter_context(start('fleet_numbered', address, str(options.history)))
                     for _ in range(min(_PROCESSES, options.robots))]
        for place, process in enumerate(processes):
            process.call('begin', names=names[place::len(processes)])
        while len(listener.robots()) < options.robots:
            time.sleep(0.1)
        for _ in range(options.load):
            ending.enter_context(closing(_Busy()))
        begin = time.monotonic()
        for process in processes:
            process.begin('send', rate_hz=options.rate, count=count, frames=options.frames)
        for moment in sorted(draw.uniform(0.1, 0.7) * options.seconds if options.kills == 1
                             else draw.uniform(0.0, options.seconds)
                             for _ in range(options.kills)):
            time.sleep(max(0.0, begin + moment - time.monotonic()))
            router.kill()
            time.sleep(options.away or draw.uniform(0.05, 1.0))
            router = router_at(address)
        costs = [process.end() for process in processes]
        _settle(listener, count)
        return _report(listener, count, costs)


def _stamps(listener: FleetListener, robot: str) -> set[int]:
    frame = f'{robot}/{FIRST}'
    known = frame in listener.buffer.frames()
    return set(listener.buffer.stamps_of(frame).tolist()) if known else set()


def _settle(listener: FleetListener, count: int) -> None:
    end = time.monotonic() + _RETURN_S
    while time.monotonic() < end and not all(
            count - 1 in _stamps(listener, robot.name) for robot in listener.robots()):
        time.sleep(0.5)
    time.sleep(_FILL_S)


class _Busy:
    """A program that takes a core."""

    def __init__(self) -> None:
        self._process = subprocess.Popen([sys.executable, '-c', 'while True: pass'])

    def close(self) -> None:
        self._process.kill()
        self._process.wait()


def _report(listener: FleetListener, count: int, costs: list[dict[str, float]]) -> bool:
    missing = 0
    for robot in listener.robots():
        arrived = len(_stamps(listener, robot.name))
        missing += count - arrived
        print(f'{robot.name}: {arrived} of {count} arrived, lost {robot.lost}, '
              f'recovered {robot.recovered}')
    grown = ', '.join(f'{cost["grown_by"]:.0f}' for cost in costs)
    print(f'missing: {missing}. A message of {costs[0]["bytes"]:.0f} bytes takes {grown} bytes '
          'where it is kept')
    return not missing


def main() -> int:
    """Parse the arguments and run it."""
    parser = argparse.ArgumentParser(prog='python -m benchmark.outages', description=__doc__)
    parser.add_argument('--robots', type=int, default=30)
    parser.add_argument('--rate', type=float, default=100.0, help='messages a second of a robot')
    parser.add_argument('--frames', type=int, default=1, help='transforms in a message')
    parser.add_argument('--history', type=int, default=2_000, help='messages that a robot keeps')
    parser.add_argument('--seconds', type=float, default=100.0)
    parser.add_argument('--kills', type=int, default=20)
    parser.add_argument('--away', type=float, help='seconds without a router; default: random')
    parser.add_argument('--load', type=int, default=0, help='processes that keep processors busy')
    parser.add_argument('--seed', type=int, default=1)
    logging.basicConfig(format='%(asctime)s %(message)s', level=logging.WARNING)
    return 0 if endure(parser.parse_args()) else 1


if __name__ == '__main__':
    sys.exit(main())
