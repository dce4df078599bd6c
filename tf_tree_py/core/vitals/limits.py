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

"""The limits beyond which something is worth a finding."""

from dataclasses import dataclass

from ..stamp import from_seconds


@dataclass(frozen=True)
class Limits:
    """
    What still counts as right; times are nanoseconds.

    :ivar cache_time: how much history the buffers of the system keep.
    :ivar max_speed: metres a second; what jumps faster is no motion.
    :ivar max_turn_rate: radians a second, likewise.
    :ivar max_delay: from a stamp to its arrival, for 95 of 100.
    :ivar max_skew: by how much one edge of a path may be older than another.
    """

    cache_time: int = from_seconds(10.0)
    max_speed: float = 10.0
    max_turn_rate: float = 30.0
    max_delay: int = from_seconds(0.5)
    max_skew: int = from_seconds(1.0)
