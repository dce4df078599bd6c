# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Long and large trees over DDS: ``python -m benchmark.long_runs SCENARIO [--minutes M]``.

The scenarios:

- ``long``: 38 transforms at 500 Hz and three listening nodes, two hours. Each looks up 100 times
  a second what was 50 ms ago, over ten edges; if tf2_ros is installed, a fourth node does so with
  it. Missed are lookups that tf2_ros answered and a node did not.
- ``hostile``: an honest chain at 100 Hz beside four hostile publishers, three minutes, and then
  the same with tf2_ros, if it is installed.
- ``stopped``: a listener that is stopped (SIGSTOP) for 30 s, and then a publisher.
- ``listeners``: 200 listeners are made and destroyed in one process.
- ``frames``: 10,000 frames, half of them at 2 Hz, one minute.

The exit status is 0 if our memory, threads and descriptors level off, and no answer is wrong. The
load of the machine is printed, because processes that get no processor miss lookups.
"""

import argparse
from collections.abc import Iterator, Sequence, Set
from contextlib import contextmanager, ExitStack
import os
from pathlib import Path
import shlex
import signal
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any, NamedTuple

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py import Buffer, TransformListener

from . import motion
from .groups.listening import start
from .processes.hostile_publisher import ATTACKS
from .processes.tick_looker import GUARDED, TICK
from .resources import cpu_s_of, levels_off, Use, use_of
from .rows import OURS, TF2_ROS
from .worker import Worker

_EDGES, _DEPTH, _RATE_HZ = 38, 10, 500
_LINE_S, _HZ = 10.0, 1e9 / TICK
_HONEST, _HONEST_HZ = 5, 100
_STOPPED_S, _CACHE_S = 30.0, 12.0


class Looker(NamedTuple):
    """A listening node in a process, and how it did."""

    name: str
    worker: Worker
    uses: list[Use]
    missed: list[int]
    times: list[tuple[float, float]]


def looker(closing: ExitStack, name: str, way: str, log: Path | None = None) -> Looker:
    """Start a node; a log gets its standard error."""
    command = [sys.executable, '-m', 'benchmark.processes.tick_looker', way]
    if log is not None:
        command = ['sh', '-c', f'exec {shlex.join(command)} 2>{shlex.quote(str(log))}']
    return Looker(name, closing.enter_context(Worker(command)), [], [], [])


def await_all(lookers: Sequence[Looker], target: str, source: str) -> None:
    """Return when all nodes receive."""
    while not all(one.worker.call('receives', target=target, source=source) for one in lookers):
        time.sleep(0.1)


def look(lookers: Sequence[Looker], target: str, source: str, seconds: float
         ) -> Iterator[tuple[int, int]]:
    """Let all nodes look up, a line's time after the other; yield the ticks of each."""
    first = round((time.time_ns() + 10**9) / TICK)
    count = round(min(seconds / 3.0, _LINE_S) * _HZ)  # at least three lines
    for _ in range(max(1, round(seconds * _HZ / count))):
        for one in lookers:
            one.worker.begin('run', first=first, count=count, target=target, source=source)
        for one in lookers:
            found = one.worker.end()
            one.missed.extend(found['missed'])
            one.times.append((found['p50_s'], found['p99_s']))
            one.uses.append(use_of(one.worker.pid))
        yield first, count
        # The time to collect these results is not looked at.
        first += count + round(0.1 * _HZ)


def report(lookers: Sequence[Looker], reference: Set[int] | None = None) -> bool:
    """
    Print how nodes did; return whether their resources level off.

    :param reference: the ticks that tf2_ros missed beside them.
    """
    level = [levels_off(one.name, one.uses) for one in lookers]
    for one in lookers:
        p50, p99 = np.median(one.times, axis=0)
        own = '' if reference is None else (
            f', {len(set(one.missed) - reference)} of which tf2_ros answered')
        print(f'{one.name}: {len(one.missed)} lookups without an answer{own}; a lookup takes '
              f'{1e6 * p50:.0f} us (p50), {1e6 * p99:.0f} us (p99)', flush=True)
    return all(level)


def long(minutes: float) -> bool:
    """Run three nodes for a long time."""
    edges = motion.chain(_EDGES).edges
    ends = edges[0].parent, edges[_DEPTH - 1].child
    with ExitStack() as closing:
        publisher = closing.enter_context(start('publisher'))
        ways = [OURS] * 3 + ([TF2_ROS] if has_tf2_ros() else [])
        lookers = [looker(closing, f'{way} {number}', way) for number, way in enumerate(ways)]
        publisher.begin('send_now', seconds=60.0 * minutes + 60.0, transforms=_EDGES,
                        rate_hz=_RATE_HZ)
        await_all(lookers, *ends)
        begin, spent = time.monotonic(), [cpu_s_of(one.worker.pid) for one in lookers]
        for _ in look(lookers, *ends, 60.0 * minutes):
            lasted = time.monotonic() - begin
            print(f'{lasted:6.0f} s: ' + '; '.join(
                f'{one.name} {one.uses[-1]}, {len(one.missed)} missed, '
                f'{100 * (cpu_s_of(one.worker.pid) - before) / lasted:.0f} % of a core'
                for one, before in zip(lookers, spent, strict=True)), flush=True)
        ours = [one for one in lookers if not one.name.startswith(TF2_ROS)]
        for one in lookers[len(ours):]:
            report([one])
        reference = set(lookers[-1].missed) if len(lookers) > len(ours) else None
        well = report(ours, reference)
        publisher.kill()
    return well


def hostile(minutes: float) -> bool:
    """Attack an honest chain."""
    well = attacked(GUARDED, minutes)
    if has_tf2_ros():
        attacked(TF2_ROS, minutes)
    return well


def attacked(way: str, minutes: float) -> bool:
    """Attack an honest chain that one node looks up; return whether that does well."""
    edges = motion.chain(_HONEST).edges
    ends = edges[0].parent, edges[-1].child
    with ExitStack() as closing, TemporaryDirectory() as folder:
        log = Path(folder, 'log')
        node = looker(closing, way, way, log)
        honest = closing.enter_context(start('publisher'))
        honest.begin('send_true', seconds=60.0 * minutes + 60.0, transforms=_HONEST,
                     rate_hz=_HONEST_HZ)
        await_all([node], *ends)
        evil = [closing.enter_context(start('hostile_publisher', name, *ends))
                for name in ATTACKS]
        for one in evil:
            os.setpriority(os.PRIO_PROCESS, one.pid, 10)
            one.begin('attack', seconds=60.0 * minutes)
        wrong, looked, begin = 0, 0, time.monotonic()
        for first, count in look([node], *ends, 60.0 * minutes):
            looked += count
            wrong += node.worker.call('wrong', first=first + count // 2, count=count // 4,
                                      edges=_HONEST)
            lines = len(log.read_bytes().splitlines())
            print(f'{time.monotonic() - begin:6.0f} s: {node.uses[-1]}, {len(node.missed)} '
                  f'of {looked} missed, {wrong} wrong, {lines} lines in the log; '
                  f'{node.worker.call("counts")}', flush=True)
        well = report([node])
        for one in (honest, *evil):
            one.kill()
    return well and not wrong


def stopped(_: float) -> bool:
    """Stop a listener, then a publisher, and go on."""
    edges = motion.chain(_EDGES).edges
    ends = edges[0].parent, edges[_DEPTH - 1].child
    well = True
    with ExitStack() as closing:
        publisher = closing.enter_context(start('publisher'))
        ways = [OURS, *([TF2_ROS] if has_tf2_ros() else [])]
        lookers = [looker(closing, way, way) for way in ways]
        publisher.begin('send_now', seconds=600.0, transforms=_EDGES, rate_hz=_RATE_HZ)
        await_all(lookers, *ends)
        for name, pids in (('the listeners', [one.worker.pid for one in lookers]),
                           ('the publisher', [publisher.pid])):
            for _ticks in look(lookers, *ends, 5.0):
                before = [(one.uses[-1], len(one.missed)) for one in lookers]
            for pid in pids:
                os.kill(pid, signal.SIGSTOP)
            time.sleep(_STOPPED_S)
            for pid in pids:
                os.kill(pid, signal.SIGCONT)
            begin = time.time_ns()
            for one in lookers:
                one.worker.begin('first_answer', target=ends[0], source=ends[1], after=begin)
            waits = [one.worker.end() for one in lookers]
            looked = sum(count for _, count in look(lookers, *ends, 5.0))
            for one, wait, (use, missed) in zip(lookers, waits, before, strict=True):
                print(f'{one.name}, after {name} stood still for {_STOPPED_S:g} s: new '
                      f'data after {1e3 * wait:.0f} ms; {use}, then '
                      f'{one.uses[-1]}; {len(one.missed) - missed} of the next '
                      f'{looked} lookups missed', flush=True)
                well = well and (one.name != OURS or len(one.missed) == missed)
        publisher.kill()
    return well


def listeners(_: float) -> bool:
    """Make and destroy listeners in this process."""
    uses = []
    with start('publisher') as publisher, node_of('benchmark_listeners') as node:
        publisher.begin('send_now', seconds=600.0, transforms=_EDGES, rate_hz=100)
        begin = time.monotonic()
        for number in range(1, 201):
            buffer = Buffer()
            listener = TransformListener(buffer, node)
            while not buffer.can_transform('frame_0', 'frame_1', Time()):
                time.sleep(0.001)
            listener.close()
            uses.append(use_of(os.getpid()))
            if number % 20 == 0:
                print(f'{number} listeners, {time.monotonic() - begin:.1f} s: {uses[-1]}',
                      flush=True)
        publisher.kill()
    return levels_off('200 listeners', uses)


def frames(minutes: float) -> bool:
    """Listen to 10,000 frames."""
    uses, spent, lost = [], [], 0
    with start('publisher') as publisher, node_of('benchmark_frames') as node:
        buffer = Buffer()
        listener = TransformListener(buffer, node)
        publisher.begin('send_crowd', seconds=60.0 * minutes + 60.0, frames=10_000, rate_hz=2.0)
        begin = time.monotonic()
        while len(buffer.frames()) < 10_000:
            time.sleep(0.01)
        print(f'{len(buffer.frames())} frames after {time.monotonic() - begin:.1f} s', flush=True)
        time.sleep(_CACHE_S)  # until the buffer keeps no more
        rng = np.random.default_rng(1)
        cpu, begin = cpu_s_of(os.getpid()), time.monotonic()
        while time.monotonic() < begin + 60.0 * minutes:
            a, b = rng.integers(0, 5000, 2)
            asked = time.perf_counter()
            try:
                buffer.lookup_transform(f'moving_{a}', f'moving_{b}',
                                        Time(nanoseconds=time.time_ns() - 1_500_000_000))
                spent.append(time.perf_counter() - asked)
            except Exception:  # noqa: B902
                lost += 1
            time.sleep(0.01)
            if len(spent) % 500 == 0:
                uses.append(use_of(os.getpid()))
        share = (cpu_s_of(os.getpid()) - cpu) / (time.monotonic() - begin)
        p50, p99 = np.percentile(spent, [50.0, 99.0])
        print(f'{buffer.statistics()}; {100 * share:.0f} % of a core; a lookup takes '
              f'{1e6 * p50:.0f} us (p50), {1e6 * p99:.0f} us (p99); {lost} without an answer')
        listener.close()
        publisher.kill()
    return levels_off('10,000 frames', uses) and not lost


@contextmanager
def node_of(name: str) -> Iterator[Node]:
    """Yield a node in this process."""
    rclpy.init()
    node = Node(name)
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def has_tf2_ros() -> bool:
    """Return whether the C++ peer is installed."""
    try:
        import tf2_ros  # noqa: F401
    except ImportError:
        return False
    return True


SCENARIOS: dict[str, tuple[Any, float]] = {
    'long': (long, 120.0), 'hostile': (hostile, 3.0), 'stopped': (stopped, 0.0),
    'listeners': (listeners, 0.0), 'frames': (frames, 1.0)}
"""Each scenario and its usual duration, minutes."""


def main() -> int:
    """Run a scenario; return 0 if all requirements are met."""
    parser = argparse.ArgumentParser(prog='python -m benchmark.long_runs', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scenario', choices=SCENARIOS)
    parser.add_argument('--minutes', type=float, help='the duration of long, hostile and frames')
    arguments = parser.parse_args()
    run, usual = SCENARIOS[arguments.scenario]
    before = os.getloadavg()[0]
    well = run(usual if arguments.minutes is None else arguments.minutes)
    print(f'load average: before {before:.1f}, after {os.getloadavg()[0]:.1f}')
    return 0 if well else 1


if __name__ == '__main__':
    sys.exit(main())
