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

"""
Time as tf_tree_py keeps it: integer nanoseconds, never float seconds.

A float64 of seconds since 1970 resolves about 240 ns, which is enough to put a
stamp on the wrong side of a sample; an int is exact. ROS types stay outside:
``tf_tree_py.ros.messages.convert`` turns them into these integers.
"""

from collections.abc import Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

LATEST = 0
"""The stamp that asks for the latest common time, as tf2's time 0 does."""

UNLIMITED = 2**64
"""The ``cache_time`` that keeps everything: no two stamps of 64 bits are further apart."""

BEGINNING = -2**63
"""The first stamp that there can be."""

FOREVER = 2**63
"""Later than every stamp: the end of a stretch of time that never ends."""

NANOSECONDS_PER_SECOND = 1_000_000_000


@overload
def from_seconds(seconds: float) -> int: ...


@overload
def from_seconds(seconds: Sequence[Any] | npt.NDArray[Any]) -> npt.NDArray[np.int64]: ...


def from_seconds(seconds: Any) -> Any:
    """
    Return the nanoseconds nearest to a number of seconds.

    Float seconds since 1970 resolve 240 ns. If your data has whole nanoseconds, or seconds
    and nanoseconds apart, use those instead.

    :param seconds: a number, or an array of any shape.
    :return: an int, or an array of the same shape.
    :raises ValueError: in an array, what is not finite or beyond 64 bits of nanoseconds.
    """
    if isinstance(seconds, float | int):
        return round(seconds * NANOSECONDS_PER_SECOND)
    array = np.asarray(seconds)
    if array.ndim == 0:
        return round(array.item() * NANOSECONDS_PER_SECOND)
    nanoseconds = _nanoseconds_of(array)
    bad = ~((nanoseconds >= BEGINNING) & (nanoseconds < FOREVER))
    if bad.any():
        first = tuple(map(int, np.argwhere(bad)[0]))
        raise ValueError(f'seconds[{", ".join(map(str, first))}] is {array[first]}: no stamp, '
                         'which is finite and has 64 bits of nanoseconds')
    return nanoseconds.astype(np.int64)


def _nanoseconds_of(seconds: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return seconds times a billion, as Python rounds it."""
    if seconds.dtype.kind in 'iu':
        return seconds.astype(object) * NANOSECONDS_PER_SECOND
    if seconds.dtype.kind not in 'fO':
        raise ValueError(f'seconds are numbers, not {seconds.dtype}')
    return np.rint(seconds.astype(float) * NANOSECONDS_PER_SECOND)


def as_seconds(stamp: int) -> float:
    """Return nanoseconds as float seconds: for people and plots, not for comparing."""
    return stamp / NANOSECONDS_PER_SECOND


def format_stamp(stamp: int) -> str:
    """Write nanoseconds as exact decimal seconds, such as ``12.000000040``."""
    sign = '-' if stamp < 0 else ''
    seconds, nanoseconds = divmod(abs(stamp), NANOSECONDS_PER_SECOND)
    return f'{sign}{seconds}.{nanoseconds:09d}'


def format_span(nanoseconds: int) -> str:
    """Write a time span in the unit that a person would use."""
    size = abs(nanoseconds)
    if size < 1_000:
        return f'{nanoseconds} ns'
    if size < 1_000_000:
        return f'{nanoseconds / 1e3:.4g} us'
    if size < NANOSECONDS_PER_SECOND:
        return f'{nanoseconds / 1e6:.4g} ms'
    return f'{nanoseconds / 1e9:.3f} s'
