# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fleet over Zenoh: the cost and the delay of listening, and the bytes on the link."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, ExitStack
from functools import partial
import math
import statistics
import time

import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core import UNLIMITED
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import configuration, open_session, RobotPublisher
from tf_tree_py.thinning import Thinner
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

# The rate of a robot that alternately drives and rests.
_SENT_HZ = 50
_SECONDS = 20
# Metres and radians.
_THRESHOLDS = (0.0, 0.001, 0.01, 0.05)


@contextmanager
def _router() -> Iterator[str]:
    """Yield the address of a router in a separate process."""
    address = f'tcp/127.0.0.1:{free_port()}'
    with start('fleet_router', address) as router:
        router.call('is_up')
        yield address


# --- listening

def listening(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the cost of listening, in several ways concurrently."""
    with _router() as address, ExitStack() as processes:
        robots = processes.enter_context(start('fleet_robots', address))
        subscribers = {way: processes.enter_context(start('fleet_subscriber', way, address))
                       for way in (OURS, PLAIN_ZENOH, BY_HAND)}
        robots.call('drive', count=max(_FLEETS), rate_hz=_RATE_HZ, seconds=1.0)
        for count in _FLEETS:
            yield _cost(robots, subscribers, count, effort)


def lag(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the delay from the publication of a transform to its lookup."""
    with _router() as address, start('fleet_robots', address) as robots, \
            start('fleet_subscriber', OURS, address) as subscriber:
        for count in _FLEETS:
            yield _lag(robots, subscriber, count, effort)


def _name(count: int) -> str:
    return f'{count} robots x {MOVING} x {_RATE_HZ:g} Hz'


def _cost(robots: Worker, subscribers: dict[str, Worker], count: int, effort: Effort) -> Row:
    """Subscribe to one fleet in all ways concurrently, several times."""
    values: dict[str, list[float]] = {
        name: [] for way in subscribers for name in (way, _lost(way))}
    for _ in range(effort.streams):
        before = {way: _usage(subscriber) for way, subscriber in subscribers.items()}
        sent = robots.call('drive', count=count, rate_hz=_RATE_HZ, seconds=effort.stream_s)
        time.sleep(0.5)
        for way, subscriber in subscribers.items():
            cpu_s, taken = (now - then for now, then
                            in zip(_usage(subscriber), before[way], strict=True))
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


def _usage(subscriber: Worker) -> tuple[float, float]:
    return subscriber.call('cpu_s'), subscriber.call('taken')


def _lag(robots: Worker, subscriber: Worker, count: int, effort: Effort) -> Row:
    """Measure lookups that wait for published poses."""
    values: dict[str, list[float]] = {'median': [], 'p99': []}
    for _ in range(effort.streams):
        robots.begin('drive', count=count, rate_hz=_RATE_HZ, seconds=effort.stream_s + 1.0)
        time.sleep(0.5)
        lags = subscriber.call(
            'lags', robots=count, leaf=f'link_{MOVING - 1}', seconds=effort.stream_s)
        robots.end()
        values['median'].append(statistics.median(lags))
        values['p99'].append(statistics.quantiles(lags, n=100)[-1])
    row = Row('fleet_lag', f'{_name(count)}: publication to lookup', 'ms', values)
    row.judge('p99', None)
    return row


# --- the link

def link(_: Contestants, __: Effort) -> Iterator[Row]:
    """Count the bytes of one robot, and measure the error of interpolating them."""
    came = [_stop_and_go(tick) for tick in range(_SECONDS * _SENT_HZ)]
    plain = sum(len(write(samples)) for samples in came) / _SECONDS
    sent, off = {'plain messages': [plain]}, {}
    for rate_hz in (0.0, _RATE_HZ):
        for threshold in _THRESHOLDS:
            name = f'{rate_hz or _SENT_HZ:g} Hz, {1000 * threshold:g} mm'
            went = _thinned(came, Thinner(
                rate_hz=rate_hz, min_move=threshold, min_turn=threshold))
            sent[name] = [_bytes_over_zenoh(went) / _SECONDS]
            off[name] = [_worst_mm(came, went)]
    row = Row('fleet_link', f'{MOVING} of 40 frames at {_SENT_HZ} Hz, half of the time at rest',
              'bytes a second', sent)
    for name in off:
        row.compare(name, 'plain messages', name=f'bytes over Zenoh: {name}')
    yield row
    yield Row('fleet_link', 'interpolated, at worst off by', 'mm', off)


def _stop_and_go(tick: int) -> list[Sample]:
    """Return the samples of a robot: a second of motion back and forth, then a second at rest."""
    stamp = START + tick * 1_000_000_000 // _SENT_HZ
    moves = max(0.0, math.sin(math.pi * stamp * 1e-9)) ** 2
    noise = np.random.default_rng(tick).normal(scale=1e-4, size=(MOVING, 6)).tolist()
    edges = [(sample.parent, sample.child) for sample in robot(0).moving(0)]
    return [Sample(*edge, stamp, (
        x + 0.3 * moves, y, z, *so3.exp((roll, pitch, yaw + 0.5 * moves))))
        for edge, (x, y, z, roll, pitch, yaw) in zip(edges, noise, strict=True)]


def _thinned(came: list[list[Sample]], thinning: Thinner) -> list[list[Sample]]:
    """Return the messages that are sent, with a clock that follows the stamps."""
    went = []
    for samples in came:
        now = samples[0].stamp
        went += [list(thinning.due(now)), list(thinning.offer(samples, now))]
    while thinning.next_turn is not None:
        went.append(list(thinning.due(math.ceil(thinning.next_turn))))
    return [samples for samples in went if samples]


def _bytes_over_zenoh(messages: list[list[Sample]]) -> int:
    """Return the bytes of messages on a TCP link, including the overhead of Zenoh."""
    with _router() as address, closing(CountingLink(int(address.rpartition(':')[2]))) as counted, \
            open_session(_over(counted), 10.0) as session, \
            RobotPublisher(session, 'robot0') as publisher, \
            start('fleet_subscriber', PLAIN_ZENOH, address) as subscriber:
        while not subscriber.call('taken'):
            publisher.send(b'')
        before = counted.sent
        for samples in messages:
            data = write(samples)
            # One after the other, as a robot sends them, so that they do not share a Zenoh frame.
            # Messages that Zenoh drops on a busy machine are sent again.
            while not counted.await_bytes(len(data), partial(publisher.send, data)):
                pass
        return counted.sent - before


def _over(counted: CountingLink) -> zenoh.Config:
    config = configuration(f'tcp/127.0.0.1:{counted.port}')
    # On one machine Zenoh sends large messages through shared memory.
    config.insert_json5('transport/shared_memory/enabled', 'false')
    return config


def _worst_mm(came: list[list[Sample]], went: list[list[Sample]]) -> float:
    """Return the largest error of a frame at the robot's own stamps, millimetres."""
    buffer = BufferCore(cache_time=UNLIMITED)
    for samples in went:
        for sample in samples:
            buffer.insert(*sample)
    return max(1000 * se3.distance(
        buffer.lookup(sample.parent, sample.child, sample.stamp), sample.pose)[0]
        for samples in came for sample in samples)
