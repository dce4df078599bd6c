# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The rule that decides when an edge is silent, and when two clocks are different.

All tools, and the tree itself, apply it. Silence is measured from the last arrival, or, if
only stamps are known, from the newest stamp. All times are nanoseconds.
"""

from .stamp import from_seconds

SILENCE = from_seconds(1.0)
"""The minimum silence of a silent edge, regardless of its rate."""

MISSED = 3.0
"""The minimum silence of a silent edge, in multiples of its usual interval."""

DEAD_SILENCE, DEAD_MISSED = from_seconds(5.0), 10.0
"""
The same for an edge that will not return: such a silence is an error instead of a warning.

The nodes of a robot that is shut down end within these seconds, one after the other.
"""

ANOTHER_CLOCK = from_seconds(30.0)
"""Stamps that are further apart than this at the same moment come from different clocks."""

_UNKNOWN_INTERVAL = from_seconds(1.0)


def mean_interval(span: float, samples: int) -> float:
    """Return the mean time between samples; 0 for fewer than two."""
    return span / max(samples - 1, 1)


def silence_allowed(interval: float) -> float:
    """
    Return how long an edge may be without samples before it is silent.

    :param interval: the usual time between two samples; 0: only one sample is known.
    """
    return max(SILENCE, MISSED * (interval or _UNKNOWN_INTERVAL))


def is_silent(silence: float, interval: float) -> bool:
    """Return whether the next sample of an edge is overdue; parameters as above."""
    return silence > silence_allowed(interval)


def is_dead(silence: float, interval: float) -> bool:
    """Return whether the next sample is so long overdue that it will not arrive."""
    return silence > max(DEAD_SILENCE, DEAD_MISSED * (interval or _UNKNOWN_INTERVAL))
