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
