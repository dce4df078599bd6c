# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The cost as the work grows, in processes and files: memory, rates of messages, many bags."""

from collections.abc import Callable, Iterator
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.rosbag2 import Reader
from tf_tree_py.bag import open_bag
from tf_tree_py.tools.archive.jobs import bags_in

from .growth import rows_by_size, SAMPLES
from .listening import start, Stream
from .. import motion
from ..bag_files import RATE_HZ, write_bag
from ..effort import Effort
from ..peers.finding import agree, Contestants
from ..rows import JAZZY, OURS, PLAIN, RAW, Row, TF2_ROS
from ..timing import interleave, time_each

RATES_HZ = (500, 1_000, 2_000, 5_000)
BAGS = (1, 10, 100, 300)

# Samples of all edges together: as many at each size, so that all have the same precision.
_STORED = 200_000
# Each run at a rate sends thousands of messages, so shorter and fewer ones than elsewhere suffice.
_LONGEST_S, _FEWER_BY = 3.0, 2
# What is measured, and its unit. A busy machine may send at a lower rate than it should.
_RATE_UNITS = {'CPU': '% of a core', 'arrived': '%', 'sent': '%'}
# Of one bag.
_SECONDS = 1
_LOOKUPS = 1000
_ENDS = 'frame_0', 'frame_5'


def memory(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure the bytes per sample over the samples of each edge, each in a process of its own."""
    ways = [OURS, *([JAZZY] if contestants.has(JAZZY) else [])]
    rounds = {('in all', size, way): [_stored(way, size)]
              for size in SAMPLES[:effort.sizes] for way in ways}
    yield from rows_by_size('growth_memory', 'samples', {'in all': 'bytes a sample'}, rounds)


def _stored(way: str, each: int) -> float:
    with start('hoard') as process:
        return float(process.call('spread_out', way=way, each=each, samples=_STORED))


# --- rates

def rates(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """
    Measure listeners of messages with one transform each, over the rate of the messages.

    One listener runs at a time, so that none waits for the processor while another one works.
    """
    ways = [OURS, PLAIN, *([TF2_ROS] if contestants.tf2_ros else [])]
    sizes = RATES_HZ[:effort.sizes]
    rounds: dict[tuple[str, int, str], list[float]] = {
        (quantity, size, way): [] for quantity in _RATE_UNITS for size in sizes for way in ways}
    for number in range(max(1, effort.streams // _FEWER_BY)):
        for way in ways[::-1] if number % 2 else ways:
            for (quantity, size), value in _listen(way, sizes, effort).items():
                rounds[quantity, size, way].append(value)
    rounds = {key: values for key, values in rounds.items() if values}
    yield from rows_by_size('growth_rates', 'Hz', _RATE_UNITS, rounds)


def _listen(way: str, sizes: Any, effort: Effort) -> dict[tuple[str, int], float]:
    """Return the CPU of one listener at all rates, and how much arrives, if it counts that."""
    found: dict[tuple[str, int], float] = {}
    with start('publisher') as publisher, start('subscriber', way) as subscriber:
        stream = Stream(publisher, {way: subscriber}, 1, sizes[0])
        stream.await_all()
        for rate_hz in sizes:
            stream.change_rate(rate_hz)
            seconds = min(effort.stream_s, _LONGEST_S)
            played = stream.play(seconds)
            sent, sent_hz = round(seconds * rate_hz), publisher.call('sent_hz')
            found['CPU', rate_hz] = 1e-4 * sent_hz * played.cpu_us[way]
            found['sent', rate_hz] = 100.0 * sent_hz / rate_hz
            if way in played.lost:
                found['arrived', rate_hz] = 100.0 * (sent - played.lost[way]) / sent
    return found


# --- bags

def bags(_: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure a folder over the number of its bags: as many bags, and as one bag in parts."""
    sizes = BAGS[:effort.sizes]
    with TemporaryDirectory() as place:
        files = [_bag(Path(place, 'all'), number) for number in range(sizes[-1])]
        turns: dict[tuple[str, int, str], Callable[[], float]] = {}
        for size in sizes:
            folder = Path(place, f'{size}')
            folder.mkdir()
            for file in files[:size]:
                os.link(file, folder / file.name)
            turns |= {(quantity, size, way): turn
                      for (quantity, way), turn in _turns(folder).items()}
        yield from rows_by_size('growth_bags', 'bags', {
            'list': 'ms a bag', 'open each, and a lookup': 'ms a bag',
            'open as one bag': 'ms a bag', 'lookup in that': 'us'},
            interleave(turns, effort.streams))


def _bag(folder: Path, number: int) -> Path:
    """Write one of several bags that follow each other in time; return its file."""
    folder.mkdir(exist_ok=True)
    file = write_bag(folder / f'run_{number}', _SECONDS, compressed=False,
                     begin_s=number * _SECONDS)
    return file.rename(folder / f'run_{number}{file.suffix}')


def _within(bag: Path) -> int:
    """Return a stamp in the middle of a bag, between samples."""
    number = int(bag.stem.removeprefix('run_'))
    return motion.START + round((number + 0.5) * _SECONDS * 1e9) + motion.PERIOD // 3


def _turns(folder: Path) -> dict[tuple[str, str], Callable[[], float]]:
    """Return what is measured of a folder, by quantity and contestant."""
    pattern = f'{folder}/*.mcap'
    bags = [Path(bag.path) for bag in bags_in([pattern])]
    whole = open_bag(folder)
    stamps = [_within(bag) for bag in bags]
    agree({'one bag': [list(whole.lookup(*_ENDS, stamp)) for stamp in stamps],
           'many bags': [list(open_bag(bag).lookup(*_ENDS, stamp))
                         for bag, stamp in zip(bags, stamps, strict=True)]})

    def look_once() -> None:
        for bag, stamp in zip(bags, stamps, strict=True):
            open_bag(bag).lookup(*_ENDS, stamp)

    def read_once() -> None:
        for bag in bags:
            with Reader(bag) as reader:
                assert sum(1 for _ in reader.messages()) == _SECONDS * RATE_HZ

    def in_ms(call: Callable[[], object]) -> Callable[[], float]:
        return lambda: 1e3 * time_each(call, 1) / len(bags)

    middle = stamps[len(stamps) // 2]
    return {
        ('list', OURS): in_ms(lambda: bags_in([pattern])),
        ('open each, and a lookup', OURS): in_ms(look_once),
        ('open each, and a lookup', RAW): in_ms(read_once),
        ('open as one bag', OURS): in_ms(lambda: open_bag(folder)),
        ('lookup in that', OURS): lambda: 1e6 * time_each(
            lambda: whole.lookup(*_ENDS, middle), _LOOKUPS)}
