# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The memory per sample, and whether the memory use is constant."""

from collections.abc import Iterator

from .listening import start
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import DEBIAN, OURS, Row

_BYTES_A_SAMPLE = 80
# The maximum growth of the process once its buffer is full.
_STEADY = 1.02
_WARM_UP_S = 30


def memory(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure with very many samples, and over a long time of traffic."""
    values = {OURS: [_hoard(effort.samples)]}
    if contestants.debian:
        values[DEBIAN] = [contestants.debian.alone('hoard', samples=effort.samples)]
    row = Row('memory', f'{effort.samples:,} samples', 'bytes a sample', values)
    row.judge(OURS, _BYTES_A_SAMPLE)
    yield row

    with start('hoard') as process:
        resident = process.call('traffic', seconds=effort.simulated_s)
    warm, most = f'{OURS}, after {_WARM_UP_S} s', f'{OURS}, the most after that'
    row = Row('memory', f'{effort.simulated_s} s of 38 x 500 Hz', 'MB',
              {warm: [resident[_WARM_UP_S - 1] / 1e6], most: [max(resident[_WARM_UP_S:]) / 1e6],
               f'{OURS}, every minute': [size / 1e6 for size in resident[59::60]]})
    row.compare(most, warm, _STEADY, unit=f'x after {_WARM_UP_S} s')
    yield row


def _hoard(samples: int) -> float:
    with start('hoard') as process:
        return process.call('hoard', samples=samples)
