# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Whether a context of rclpy still runs, and whether the current thread has it locked.

From Kilted on, ``Context.shutdown`` destroys all nodes while it holds the lock of the context, and
``Context.ok`` takes that lock. A thread that a node waits for during its destruction therefore
must neither call ``ok`` nor destroy a node itself.
"""

from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle


def is_running(context: Context) -> bool:
    """Return the same as ``context.ok()``, without the lock of the context."""
    handle: Any = context.handle
    if handle is None:
        return False
    if not hasattr(handle, 'ok'):  # pragma: no cover - every rclpy so far has it
        return context.ok()
    try:
        with handle:
            return bool(handle.ok())
    except InvalidHandle:
        return False


def is_locked_here(context: Context) -> bool:
    """Return whether the current thread holds the context's lock, because it shuts it down."""
    is_owned = getattr(getattr(context, '_lock', None), '_is_owned', None)
    return is_owned is not None and bool(is_owned())
