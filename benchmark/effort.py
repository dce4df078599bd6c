"""How much to measure."""

from typing import NamedTuple


class Effort(NamedTuple):
    """
    The sizes of a run.

    :ivar rounds: how often all contestants take turns.
    :ivar lookups: in a round.
    :ivar stream_s: how long a stream of messages lasts.
    :ivar streams: how many of each kind.
    :ivar waits: how many blocked lookups to time.
    :ivar simulated_s: how much traffic to simulate for the memory.
    :ivar samples: how many to store for the memory.
    """

    rounds: int
    lookups: int
    stream_s: float
    streams: int
    waits: int
    simulated_s: int
    samples: int


FULL = Effort(rounds=21, lookups=2000, stream_s=5.0, streams=7, waits=1000,
              simulated_s=3600, samples=1_000_000)
QUICK = Effort(rounds=7, lookups=500, stream_s=2.0, streams=3, waits=200,
               simulated_s=60, samples=1_000_000)
