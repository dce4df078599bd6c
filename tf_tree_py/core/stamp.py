# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Time in tf_tree_py: integer nanoseconds, never float seconds; and the rule of silence.

A float64 of seconds since 1970 has a resolution of about 240 ns, which is enough to put a
stamp on the wrong side of a sample; an int is exact. ROS types are not used here:
``tf_tree_py.ros.messages.convert`` converts them to these integers.

One rule decides when an edge is silent, and when two clocks are different. All tools, and the
tree itself, apply it. Silence is measured from the last arrival, or, if only stamps are known,
from the newest stamp.

Constants and pure functions: no state, any thread.
"""

from collections.abc import Sequence
import math
import sys
from typing import overload

import numpy as np
from numpy.typing import NDArray

LATEST = 0
"""The stamp that means the latest common time, like tf2's time 0."""

UNLIMITED = 2**64
"""The ``cache_time`` that keeps everything: no two stamps of 64 bits are further apart."""

BEGINNING = -2**63
"""The earliest possible stamp."""

FOREVER = 2**63
"""Later than every stamp: the end of an unlimited span."""

NANOSECONDS_PER_SECOND = 1_000_000_000


@overload
def from_seconds(seconds: float) -> int: ...


@overload
def from_seconds(seconds: Sequence[object] | NDArray[np.generic]) -> NDArray[np.int64]: ...


def from_seconds(seconds: object) -> int | NDArray[np.int64]:
    """
    Return the nanoseconds nearest to a number of seconds.

    Float seconds since 1970 have a resolution of 240 ns. If your data has integer nanoseconds,
    or separate seconds and nanoseconds, use those instead.

    :param seconds: a number, or an array of any shape.
    :return: an int, or an array of the same shape.
    :raises ValueError: not a number, not finite, or beyond 64 bits of nanoseconds: as a
        time, before 1678 or after 2262.
    """
    if isinstance(seconds, float | int):
        return _one(seconds)
    array = np.asarray(seconds)
    if array.ndim == 0:
        return _one(array.item())
    nanoseconds = _nanoseconds_of(array)
    bad = ~((nanoseconds >= BEGINNING) & (nanoseconds < FOREVER))
    if bad.any():
        first = tuple(map(int, np.argwhere(bad)[0]))
        raise ValueError(f'seconds[{", ".join(map(str, first))}] is {array[first]}, which is not '
                         'a stamp: stamps are finite and have 64 bits of nanoseconds')
    return nanoseconds.astype(np.int64)


def _one(seconds: object) -> int:
    if not isinstance(seconds, float | int):
        raise ValueError(
            f'seconds must be a number, and {seconds!r} is a {type(seconds).__name__}')
    # A float of numpy would warn of an overflow.
    exact = seconds if isinstance(seconds, int) else float(seconds)
    nanoseconds = exact * NANOSECONDS_PER_SECOND
    if BEGINNING <= nanoseconds < FOREVER:
        return round(nanoseconds)
    if not abs(exact) < math.inf:
        raise ValueError(f'{exact} seconds are not a time')
    # No float is as large as some integers.
    given = f'{exact:g}' if abs(exact) <= sys.float_info.max else 'That many'
    raise ValueError(
        f'{given} seconds do not fit into 64 bits of nanoseconds: as a time they are '
        'outside the years 1678 to 2262. Are they milliseconds, or nanoseconds already?')


def unit_that_fits(stamp: int, oldest: int, latest: int) -> str:
    """
    Return a hint if a stamp would be within a span in another unit, else ''.

    :param stamp: the requested stamp.
    :param oldest: the beginning of the span that has data, nanoseconds.
    :param latest: its end.
    """
    for unit, size, cure in (
            ('seconds', 10**9, f'tf_tree_py.from_seconds({stamp})'),
            ('milliseconds', 10**6, f'{stamp} * 1_000_000'),
            ('microseconds', 10**3, f'{stamp} * 1_000')):
        # A stamp rounded to a whole number of the unit may be just outside.
        if stamp and oldest - size < stamp * size < latest + size:
            return f'Stamps are nanoseconds, and {stamp} would fit if it were {unit}: {cure}'
    return ''


def _nanoseconds_of(seconds: NDArray[np.generic]) -> NDArray[np.float64] | NDArray[np.object_]:
    """Return seconds times a billion, rounded as Python rounds."""
    if seconds.dtype.kind in 'iu':
        return seconds.astype(object) * NANOSECONDS_PER_SECOND
    if seconds.dtype.kind not in 'fO':
        raise ValueError(f'seconds are numbers, not {seconds.dtype}')
    try:
        with np.errstate(over='ignore'):
            return np.rint(seconds.astype(float) * NANOSECONDS_PER_SECOND)
    except (TypeError, OverflowError) as error:  # an object that is not a number, or too large
        raise ValueError(f'seconds are numbers that fit into 64 bits of nanoseconds: {error}'
                         ) from None


def as_seconds(stamp: int) -> float:
    """Return nanoseconds as float seconds: for display and plots, not for comparisons."""
    return stamp / NANOSECONDS_PER_SECOND


def format_stamp(stamp: int) -> str:
    """Return nanoseconds as exact decimal seconds, such as ``12.000000040``."""
    sign = '-' if stamp < 0 else ''
    seconds, nanoseconds = divmod(abs(stamp), NANOSECONDS_PER_SECOND)
    return f'{sign}{seconds}.{nanoseconds:09d}'


def format_span(nanoseconds: int) -> str:
    """Return a time span as text, in a suitable unit."""
    size = abs(nanoseconds)
    if size < 1_000:
        return f'{nanoseconds} ns'
    if size < 1_000_000:
        return f'{nanoseconds / 1e3:.4g} us'
    if size < NANOSECONDS_PER_SECOND:
        return f'{nanoseconds / 1e6:.4g} ms'
    return f'{nanoseconds / 1e9:.3f} s'


# --- the rule of silence

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
