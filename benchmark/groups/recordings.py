# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Opening a recording: time and memory per transform, and saved trees."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from .listening import start
from ..bag_files import RATE_HZ, TRANSFORMS, write_bag
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import OURS, RAW, Row, RUST
from ..timing import interleave

LOOP = 'rosbags, a loop'
_OF_RUST = 0.6
# A quarter of the raw rate, or half of it where decompression takes most of the time.
_OF_RAW = {'uncompressed': 4.0, 'zstd': 2.0}
_BYTES_A_TRANSFORM = 80
_PEAK = 1.3
_SAVED_MS = 50
# In a shorter one, the process's own memory would count as the recording's.
_SHORTEST_S = 300


def recordings(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure all ways of reading a bag, and a saved tree made from it."""
    seconds = max(effort.simulated_s, _SHORTEST_S)
    with TemporaryDirectory() as folder:
        for compression, of_raw in _OF_RAW.items():
            path = write_bag(Path(folder, compression), seconds, compressed=compression == 'zstd')
            yield from _opening(path, f'{seconds} s, {compression}',
                                seconds * RATE_HZ * TRANSFORMS, of_raw, contestants, effort)
        yield _saved(path, Path(folder, 'run.tftree'), effort)


def _opening(path: Path, name: str, transforms: int, of_raw: float, contestants: Contestants,
             effort: Effort) -> Iterator[Row]:
    memory: list[dict[str, float]] = []
    turns: dict[str, Callable[[], float]] = {
        OURS: partial(_measure, 'ours', path, transforms, memory),
        RAW: partial(_measure, 'raw', path, transforms),
        LOOP: partial(_measure, 'loop', path, transforms)}
    if contestants.rust:
        turns[RUST] = partial(_measure, 'rust', path, transforms)
    row = Row('bag', name, 'us a transform', interleave(turns, effort.streams))
    row.compare(OURS, RUST, _OF_RUST)
    row.compare(OURS, RAW, of_raw)
    row.compare(OURS, LOOP)
    yield row
    end, peak = f'{OURS}, in the end', f'{OURS}, at the peak'
    row = Row('bag', f'{name}: memory', 'bytes a transform', {
        end: [each['resident'] / transforms for each in memory],
        peak: [each['peak'] / transforms for each in memory]})
    row.judge(end, _BYTES_A_TRANSFORM)
    row.compare(peak, end, _PEAK, unit='x in the end')
    yield row


def _measure(way: str, path: Path, transforms: int,
             memory: list[dict[str, float]] | None = None) -> float:
    """Return the microseconds per transform of one way of reading."""
    with start('ingest') as process:
        found = process.call(way, path=str(path))
    if memory is not None:
        memory.append(found)
    return 1e6 * found['seconds'] / found.get('transforms', transforms)


def _saved(path: Path, saved: Path, effort: Effort) -> Row:
    with start('ingest') as process:
        process.call('save', path=str(path), target=str(saved))
    values = []
    for _ in range(effort.streams):
        with start('ingest') as process:
            values.append(1e3 * process.call('saved', path=str(saved))['seconds'])
    row = Row('bag', f'a saved tree of {saved.stat().st_size / 1e6:.0f} MB, and a lookup', 'ms',
              {OURS: values})
    row.judge(OURS, _SAVED_MS)
    return row
