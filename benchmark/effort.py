# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The sizes of a benchmark run."""

from typing import NamedTuple


class Effort(NamedTuple):
    """
    The sizes of a run.

    :ivar rounds: number of turns of every contestant.
    :ivar lookups: number per round.
    :ivar stream_s: duration of a stream of messages.
    :ivar streams: number of streams of each kind.
    :ivar waits: number of blocked lookups to time.
    :ivar simulated_s: duration of the traffic that is simulated for the memory.
    :ivar samples: number to store for the memory.
    :ivar sequences: number of each of KinHEC's tracks; None: all.
    :ivar sizes: number of sizes, the smallest first, over which growth is measured.
    """

    rounds: int
    lookups: int
    stream_s: float
    streams: int
    waits: int
    simulated_s: int
    samples: int
    sequences: int | None
    sizes: int


FULL = Effort(rounds=21, lookups=2000, stream_s=5.0, streams=7, waits=1000,
              simulated_s=3600, samples=1_000_000, sequences=None, sizes=4)
QUICK = Effort(rounds=7, lookups=500, stream_s=2.0, streams=3, waits=200,
               simulated_s=60, samples=1_000_000, sequences=12, sizes=3)
