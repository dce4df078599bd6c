"""
Time as tf_tree_py keeps it: integer nanoseconds, never float seconds.

A float64 of seconds since 1970 resolves about 240 ns, which is enough to put a
stamp on the wrong side of a sample; an int is exact. ROS types stay outside:
``tf_tree_py.ros.convert`` turns them into these integers.
"""

LATEST = 0
"""The stamp that asks for the latest common time, as tf2's time 0 does."""

NANOSECONDS_PER_SECOND = 1_000_000_000


def from_seconds(seconds: float) -> int:
    """Return the nanoseconds nearest to a number of seconds."""
    return round(seconds * NANOSECONDS_PER_SECOND)


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
