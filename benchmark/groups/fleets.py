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

"""A fleet over Zenoh: what listening costs, how late it is, and what goes over the link."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, ExitStack
from functools import partial
import math
import statistics
import time

import numpy as np
from tf_tree_py.core import BufferCore, UNLIMITED
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.wire import write
from tf_tree_py.core.departures.thinning import Thinning
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.fleet import configuration, open_session, RobotPublisher
import zenoh

from .listening import start
from ..counting_link import CountingLink, free_port
from ..effort import Effort
from ..motion import START
from ..peers.finding import Contestants
from ..processes.fleet_robots import MOVING, robot, STATIC
from ..rows import BY_HAND, OURS, PLAIN_ZENOH, Row
from ..worker import Worker

_FLEETS = (1, 10, 100)
_RATE_HZ = 10.0

# A robot that drives and rests by turns, and how often it says so itself.
_SOURCE_HZ = 50
_SECONDS = 20
# Metres and radians.
_THRESHOLDS = (0.0, 0.001, 0.01, 0.05)


@contextmanager
def _router() -> Iterator[str]:
    """Yield the address of a router in a process of its own."""
    address = f'tcp/127.0.0.1:{free_port()}'
    with start('fleet_router', address) as router:
        router.call('is_up')
        yield address


# --- listening

def hearing(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure what listening costs, in several ways at the same time."""
    with _router() as address, ExitStack() as processes:
        robots = processes.enter_context(start('fleet_robots', address))
        ears = {way: processes.enter_context(start('fleet_ear', way, address))
                for way in (OURS, PLAIN_ZENOH, BY_HAND)}
        robots.call('drive', count=max(_FLEETS), rate_hz=_RATE_HZ, seconds=1.0)
        for count in _FLEETS:
            yield _cost(robots, ears, count, effort)


def lag(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure how long after its publication a transform is looked up."""
    with _router() as address, start('fleet_robots', address) as robots, \
            start('fleet_ear', OURS, address) as ear:
        for count in _FLEETS:
            yield _lag(robots, ear, count, effort)


def _name(count: int) -> str:
    return f'{count} robots x {MOVING} x {_RATE_HZ:g} Hz'


def _cost(robots: Worker, ears: dict[str, Worker], count: int, effort: Effort) -> Row:
    """Let all listen to one fleet at the same time, several times."""
    values: dict[str, list[float]] = {name: [] for way in ears for name in (way, _lost(way))}
    for _ in range(effort.streams):
        before = {way: _usage(ear) for way, ear in ears.items()}
        sent = robots.call('drive', count=count, rate_hz=_RATE_HZ, seconds=effort.stream_s)
        time.sleep(0.5)
        for way, ear in ears.items():
            cpu_s, taken = (now - then for now, then
                            in zip(_usage(ear), before[way], strict=True))
            values[way].append(cpu_s / sent * 1e6)
            messages = (taken - count * STATIC) / MOVING if way == OURS else taken
            values[_lost(way)].append(sent - messages)
    row = Row('fleet', _name(count), 'us a message', values)
    row.compare(OURS, PLAIN_ZENOH)
    row.compare(OURS, BY_HAND)
    row.judge(_lost(OURS), 0, name=f'{row.name}: messages lost', unit='')
    return row


def _lost(way: str) -> str:
    return f'{way}, lost'


def _usage(ear: Worker) -> tuple[float, float]:
    return ear.call('cpu_s'), ear.call('taken')


def _lag(robots: Worker, ear: Worker, count: int, effort: Effort) -> Row:
    """Let lookups wait for what robots publish."""
    values: dict[str, list[float]] = {'median': [], 'p99': []}
    for _ in range(effort.streams):
        robots.begin('drive', count=count, rate_hz=_RATE_HZ, seconds=effort.stream_s + 1.0)
        time.sleep(0.5)
        lags = ear.call('lags', robots=count, leaf=f'link_{MOVING - 1}', seconds=effort.stream_s)
        robots.end()
        values['median'].append(statistics.median(lags))
        values['p99'].append(statistics.quantiles(lags, n=100)[-1])
    row = Row('fleet_lag', f'{_name(count)}: publication to lookup', 'ms', values)
    row.judge('p99', None)
    return row


# --- the link

def link(_: Contestants, __: Effort) -> Iterator[Row]:
    """Count what one robot sends, and how far off what is interpolated out of that is."""
    came = [_stop_and_go(tick) for tick in range(_SECONDS * _SOURCE_HZ)]
    plain = sum(len(write(samples)) for samples in came) / _SECONDS
    sent, off = {'plain messages': [plain]}, {}
    for rate_hz in (0.0, _RATE_HZ):
        for threshold in _THRESHOLDS:
            name = f'{rate_hz or _SOURCE_HZ:g} Hz, {1000 * threshold:g} mm'
            went = _thinned(came, Thinning(
                rate_hz=rate_hz, min_move=threshold, min_turn=threshold))
            sent[name] = [_bytes_over_zenoh(went) / _SECONDS]
            off[name] = [_worst_mm(came, went)]
    row = Row('fleet_link', f'{MOVING} of 40 frames at {_SOURCE_HZ} Hz, half of the time at rest',
              'bytes a second', sent)
    for name in off:
        row.compare(name, 'plain messages', name=f'bytes over Zenoh: {name}')
    yield row
    yield Row('fleet_link', 'interpolated, at worst off by', 'mm', off)


def _stop_and_go(tick: int) -> list[Sample]:
    """Return what a robot says: it goes and comes back for a second, and rests for one."""
    stamp = START + tick * 1_000_000_000 // _SOURCE_HZ
    moves = max(0.0, math.sin(math.pi * stamp * 1e-9)) ** 2
    noise = np.random.default_rng(tick).normal(scale=1e-4, size=(MOVING, 6)).tolist()
    edges = [(sample.parent, sample.child) for sample in robot(0).moving(0)]
    return [Sample(*edge, stamp, (
        x + 0.3 * moves, y, z, *so3.exp((roll, pitch, yaw + 0.5 * moves))))
        for edge, (x, y, z, roll, pitch, yaw) in zip(edges, noise, strict=True)]


def _thinned(came: list[list[Sample]], thinning: Thinning) -> list[list[Sample]]:
    """Return the messages that go, as if the clock went by the stamps."""
    went = []
    for samples in came:
        now = samples[0].stamp
        went += [list(thinning.due(now)), list(thinning.offer(samples, now))]
    while thinning.next_turn is not None:
        went.append(list(thinning.due(math.ceil(thinning.next_turn))))
    return [samples for samples in went if samples]


def _bytes_over_zenoh(messages: list[list[Sample]]) -> int:
    """Return how many bytes messages are on a link of TCP, with all that Zenoh adds."""
    with _router() as address, closing(CountingLink(int(address.rpartition(':')[2]))) as counted, \
            open_session(_over(counted), 10.0) as session, \
            RobotPublisher(session, 'robot0') as publisher, \
            start('fleet_ear', PLAIN_ZENOH, address) as ear:
        while not ear.call('taken'):
            publisher.send(b'')
        before = counted.sent
        for samples in messages:
            data = write(samples)
            # One after the other, as a robot sends: else they would share a frame. What
            # Zenoh drops, on a machine that is busy, goes once more.
            while not counted.await_bytes(len(data), partial(publisher.send, data)):
                pass
        return counted.sent - before


def _over(counted: CountingLink) -> zenoh.Config:
    config = configuration(f'tcp/127.0.0.1:{counted.port}')
    # On one machine Zenoh sends what is large through shared memory.
    config.insert_json5('transport/shared_memory/enabled', 'false')
    return config


def _worst_mm(came: list[list[Sample]], went: list[list[Sample]]) -> float:
    """Return how far a frame was off at worst at any stamp of the robot's own."""
    buffer = BufferCore(cache_time=UNLIMITED)
    for samples in went:
        for sample in samples:
            buffer.insert(*sample)
    return max(1000 * se3.distance(
        tuple(buffer.lookup(sample.parent, sample.child, sample.stamp)), sample.pose)[0]
        for samples in came for sample in samples)
