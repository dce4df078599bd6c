# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits beyond which something becomes a finding."""

from dataclasses import dataclass

from tf_tree_py.core.stamp import from_seconds


@dataclass(frozen=True)
class Thresholds:
    """
    The limits of normal values; times are nanoseconds.

    An isolated fast step is judged by narrower limits than an edge that is always fast, which
    may be a car or a wheel.

    :ivar cache_time: how much history the buffers of the system keep.
    :ivar max_speed: metres per second; a single faster step is not motion.
    :ivar max_turn_rate: radians per second, likewise.
    :ivar max_delay: from a stamp to its arrival, for 95 % of the samples.
    :ivar max_skew: by how much one edge of a path may be older than another.
    :ivar max_usual_speed: metres per second; a faster usual step of an edge is not motion.
    :ivar max_usual_turn_rate: radians per second, likewise.
    """

    cache_time: int = from_seconds(10.0)
    max_speed: float = 10.0
    max_turn_rate: float = 30.0
    max_delay: int = from_seconds(0.5)
    max_skew: int = from_seconds(1.5)
    max_usual_speed: float = 70.0
    max_usual_turn_rate: float = 70.0
