# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Which executors another thread may call.

rclpy's experimental ``EventsExecutor`` has a queue that waits until ``time_point::max()`` when it
spins without a timeout. Where rclpy was built for a glibc before 2.30, as the wheels of PyPI are,
the C++ library converts this time to another clock, which overflows: the queue never waits, and
almost never releases its mutex. Nothing is delivered then. A call from another thread waits for
the mutex while it holds Python's lock, and so stops all threads of Python.

Whoever calls a user's executor asks here first. No lock is taken, so it may be asked with the
buffer's lock held, as at the beginning of a wait.
"""

from functools import cache
from pathlib import Path
import sys

from rclpy.impl.implementation_singleton import rclpy_implementation
import rclpy.logging


def takes_calls(executor: object) -> bool:
    """Return whether another thread may call an executor, to wake it or to give it a task."""
    cls = getattr(rclpy_implementation, 'EventsExecutor', ())
    return not isinstance(executor, cls) or not has_broken_queue()


@cache
def has_broken_queue() -> bool:
    """Return whether this build of rclpy has the fault; log it once."""
    try:
        code = Path(rclpy_implementation.__file__).read_bytes()
    except OSError:
        return False
    broken = (sys.platform == 'linux' and b'events_executor' in code
              and b'pthread_cond_timedwait' in code and b'pthread_cond_clockwait' not in code)
    if broken:
        rclpy.logging.get_logger('tf_tree_py').warning(
            'The EventsExecutor of this build of rclpy delivers nothing if it spins without a '
            'timeout, and a call from another thread would then stop all threads. So transforms '
            'do not wake it: call spin_once(timeout_sec=...) in a loop, or use another executor')
    return broken
