# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One tree for all processes of a machine, beside a tree for each."""

from collections.abc import Iterator
from contextlib import ExitStack
import os
import time

from tf_tree_py.shared.place import folder

from .listening import start
from .. import motion
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import ALONE, BESIDE, OURS, OWN, Row, RUST, scaled, SHARED, TF2_ROS, TF_SHARE
from ..timing import interleave, Rounds
from ..worker import Worker

_TRANSFORMS, _HZ, _WINDOW_S = 38, 500, 10.0
_EDGES, _LOOP_HZ, _BEHIND_S = 10, 100.0, 0.03
# Fast DDS may stall the publisher for a third of a second, about three seconds after a process has
# joined; see docs/performance_shared.md.
_SETTLE_S = 5.0
_MARGIN_S = 1.0
# The most that the CPU and the delay of a loop may be, as a multiple of those without a listener;
# the CPU of the writer, of a listener's; a lookup, of one in a tree of the same process, and of
# the latest transform; an attachment, ms; and the file, of its window.
_CPU, _LATE, _WRITER, _LOOKUP, _LATEST, _ATTACH_MS, _SIZE = 1.3, 1.3, 1.15, 1.2, 1.4, 5.0, 1.5
_BYTES_A_SAMPLE = 64
_WAITING, _WAITS = 30, 20
_DEPTHS = 1, 10, 30
_SAMPLES = 'the samples of a window'


def sharing(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the processes of a robot with ROS; then the shared memory itself, without it."""
    yield from _loops(contestants, effort)
    yield from _writer(effort)
    ways = [SHARED, *([RUST] if contestants.has(RUST) else [])]
    name = 1_000_000 + os.getpid()
    with ExitStack() as writers:
        for way in ways:
            writer = writers.enter_context(start('tree_writer', way, str(name)))
            writer.call('begin', transforms=_TRANSFORMS, rate_hz=_HZ, history_s=_WINDOW_S)
            writer.call('run')
        yield from _lookups([*ways, OWN], name, effort)
        yield from _plain_loops(ways, name, effort)
    yield from _waits(name)


# --- nodes

def _loops(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure so many processes, each with a loop of 100 Hz that looks up over ten edges."""
    tf2_ros = [TF2_ROS] if contestants.tf2_ros else []
    for count, ways in ((1, [ALONE, BESIDE, SHARED, OURS, *tf2_ros]), (3, [SHARED, OURS]),
                        (10, [SHARED])):
        found: dict[str, list[dict[str, float]]] = {way: [] for way in ways}
        for number in range(effort.streams):
            for way in reversed(ways) if number % 2 else ways:
                found[way].append(_run(way, count, effort.stream_s))
        yield from _rows_of_loops(count, found)


def _run(way: str, count: int, seconds: float) -> dict[str, float]:
    """Run loops while a publisher sends; return the medians over the loops, and all CPU."""
    edges = motion.chain(_TRANSFORMS).edges
    ends = {'target': edges[0].parent, 'source': edges[_EDGES - 1].child}
    node_way = OURS if way in (ALONE, BESIDE) else way
    with ExitStack() as processes:
        publisher = processes.enter_context(start('publisher'))
        sharer = processes.enter_context(start('sharer')) if way in (SHARED, BESIDE) else None
        nodes = [processes.enter_context(start('control_loop', node_way)) for _ in range(count)]
        stream = {'transforms': _TRANSFORMS, 'rate_hz': _HZ}
        for node in nodes:
            while not node.call('receives', **ends):
                publisher.call('send_now', seconds=0.2, **stream)
        publisher.begin('send_now', seconds=_SETTLE_S + seconds + _MARGIN_S, **stream)
        time.sleep(_SETTLE_S)
        if sharer is not None:
            sharer.call('begin')
        for node in nodes:
            node.begin('run', **ends, rate_hz=_LOOP_HZ, behind_s=_BEHIND_S, seconds=seconds,
                       listens=way not in (ALONE, BESIDE))
        measured = [node.end() for node in nodes]
        cores = sharer.call('cores') if sharer is not None else 0.0
        publisher.end()
    each = {key: sum(one[key] for one in measured) / count for key in measured[0]}
    return each | {'all_cores': sum(one['cores'] for one in measured) + cores}


def _rows_of_loops(count: int, found: dict[str, list[dict[str, float]]]) -> Iterator[Row]:
    def row(name: str, unit: str, key: str, factor: float) -> Row:
        return Row('shared', f'{count} x a loop of 100 Hz: {name}', unit, {
            way: [one[key] * factor for one in rounds] for way, rounds in found.items()})

    cpu = row('CPU of each', '% of a core', 'cores', 1e2)
    cpu.compare(SHARED, ALONE, _CPU)
    cpu.compare(SHARED, BESIDE)
    cpu.compare(SHARED, OURS)
    yield cpu
    yield row('CPU of all, with tf_share', '% of a core', 'all_cores', 1e2)
    yield row('a lookup, p50', 'us', 'p50_s', 1e6)
    late = row('it wakes late, p99', 'ms', 'late_p99_s', 1e3)
    late.compare(SHARED, ALONE)
    late.compare(SHARED, BESIDE, _LATE)
    yield late
    yield row('lookups not answered', '%', 'unanswered', 1e2)


def _writer(effort: Effort) -> Iterator[Row]:
    """Measure tf_share, beside a listener that receives the same messages."""
    shares: list[float] = []
    listens: list[float] = []
    sizes: list[float] = []
    stream = {'transforms': _TRANSFORMS, 'rate_hz': _HZ}
    with start('publisher') as publisher, start('sharer') as sharer, \
            start('subscriber', OURS) as subscriber:
        while not subscriber.call('usage', transforms=_TRANSFORMS)['received']:
            publisher.call('send_now', seconds=0.2, **stream)
        publisher.call('send_now', seconds=_SETTLE_S + _WINDOW_S, **stream)
        for _ in range(effort.streams):
            before = subscriber.call('usage', transforms=_TRANSFORMS)['cpu_s']
            sharer.call('begin')
            began = time.monotonic()
            publisher.call('send_now', seconds=effort.stream_s, **stream)
            lasted = time.monotonic() - began
            shares.append(sharer.call('cores') * 1e2)
            listens.append((subscriber.call('usage', transforms=_TRANSFORMS)['cpu_s'] - before)
                           / lasted * 1e2)
            sizes.append(sum(path.stat().st_size for path in folder().glob('*.tree')) / 1e6)
    row = Row('shared', 'receiving', '% of a core', {TF_SHARE: shares, OURS: listens})
    row.compare(TF_SHARE, OURS, _WRITER, unit='x a listener')
    yield row
    samples = _TRANSFORMS * _HZ * _WINDOW_S * _BYTES_A_SAMPLE / 1e6
    row = Row('shared', 'the file, in all rounds', 'MB', {
        TF_SHARE: sizes, _SAMPLES: [samples] * len(sizes)})
    row.compare(TF_SHARE, _SAMPLES, _SIZE)
    yield row


# --- memory, without ROS

def _lookups(ways: list[str], name: int, effort: Effort) -> Iterator[Row]:
    """Measure lookups in a tight loop, while the writer writes."""
    with ExitStack() as processes:
        readers = {way: processes.enter_context(start('tree_reader', way, str(name)))
                   for way in ways}
        for kind, is_message in ('lookup_transform', True), ('lookup', False):
            for age, behind_s, goal in (('30 ms old', _BEHIND_S, _LOOKUP),
                                        ('latest', None, _LATEST)):
                for depth in _DEPTHS:
                    turns = {way: _Turn(reader, depth, behind_s, effort.lookups, is_message)
                             for way, reader in readers.items() if way != RUST or not is_message}
                    row = Row('shared', f'{kind}, {age}, depth {depth}', 'us',
                              scaled(interleave(turns, effort.rounds), 1e6))
                    row.compare(SHARED, OWN, goal)
                    row.compare(SHARED, RUST)
                    yield row
        attached = {way: [reader.call('attach_s') * 1e3 for _ in range(effort.rounds)]
                    for way, reader in readers.items() if way != OWN}
    row = Row('shared', 'attaching', 'ms', attached)
    row.judge(SHARED, _ATTACH_MS)
    yield row


class _Turn:
    """A turn of a reader; it returns the time of a lookup, seconds."""

    def __init__(self, reader: Worker, depth: int, behind_s: float | None, count: int,
                 is_message: bool) -> None:
        self._reader = reader
        self._asked = {'depth': depth, 'behind_s': behind_s, 'count': count,
                       'is_message': is_message}

    def __call__(self) -> float:
        return float(self._reader.call('lookup_s', **self._asked))


def _plain_loops(ways: list[str], name: int, effort: Effort) -> Iterator[Row]:
    """Measure the same loop in a process without ROS."""
    with ExitStack() as processes:
        readers = {way: processes.enter_context(start('tree_reader', way, str(name)))
                   for way in ways}
        turns = {way: [reader.call('loop', depth=_EDGES, rate_hz=_LOOP_HZ, behind_s=_BEHIND_S,
                                   seconds=effort.stream_s) for _ in range(effort.streams)]
                 for way, reader in readers.items()}
    for key, label, unit, factor in (('cores', 'CPU', '% of a core', 1e2),
                                     ('p50_s', 'a lookup, p50', 'us', 1e6)):
        values: Rounds = {way: [one[key] * factor for one in rounds]
                          for way, rounds in turns.items()}
        row = Row('shared', f'a loop of 100 Hz without ROS: {label}', unit, values)
        row.compare(SHARED, RUST)
        yield row


def _waits(name: int) -> Iterator[Row]:
    """Measure the time from an insertion until lookups return that wait for it."""
    with ExitStack() as processes:
        writer = processes.enter_context(start('tree_writer', SHARED, str(name)))
        writer.call('begin', transforms=1, rate_hz=_HZ, history_s=_WINDOW_S)
        readers = [processes.enter_context(start('tree_reader', SHARED, str(name)))
                   for _ in range(_WAITING)]
        for reader in readers:
            reader.call('attach_s')  # it has begun
        stamp = time.time_ns()
        for some in readers[:1], readers:
            ends = []
            for _ in range(_WAITS):
                stamp += 10**7
                for reader in some:
                    reader.begin('wait', stamp=stamp)
                time.sleep(0.5)  # until all wait
                began = writer.call('insert', stamp=stamp)
                ends.append([(reader.end() - began) * 1e3 for reader in some])
            label = f'{len(some)} processes' if len(some) > 1 else 'a process'
            yield Row('shared', f'waiting: from an insertion to {label}', 'ms', {
                f'{SHARED}, the first': list(map(min, ends)),
                f'{SHARED}, the last': list(map(max, ends))})
