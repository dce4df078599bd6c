# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Locks that are free in a child of ``os.fork()``, and other repairs that a child needs.

A child has the memory of its parent, but only the thread that forked. A lock that another
thread held at that moment would stay locked in the child, and the data that it protects would
be inconsistent. So the thread that forks holds all of these locks during the fork.

The rules:

- A lock of a buffer, of its observers and of its logs is made here: a child goes on to use them.
- A thread that holds such a lock does not fork, and holds it for moments: a fork waits for five
  seconds, and then goes on without the locks that it lacks.
- ``_known`` is the last lock that anyone takes (docs/design.md), because a lock may be made with
  others held: that of a snapshot is, with the buffer's.
- ``repair_in_child`` runs with all locks held, before any other code of the child, so it takes
  none that was not made here.
"""

import os
import threading
import time
from typing import Protocol, TypeAlias, TypeVar
import weakref

# The maximum wait, much longer than any lock is held. A thread that forks while it holds one of
# these locks itself would otherwise wait forever.
_PATIENCE_S = 5.0
_TURN_S = 0.2


class Repaired(Protocol):
    """An object with state that threads of the parent may have left behind."""

    def repair_in_child(self) -> None:
        """Restore a consistent state, with all locks held, before the child's code continues."""


# A text, because both are functions before Python 3.13.
Lock: TypeAlias = 'threading.Lock | threading.RLock'
_Made = TypeVar('_Made', bound=Lock)

# Protects the data of this module, and is held during a fork.
_known = threading.RLock()
_locks: 'weakref.WeakSet[Lock]' = weakref.WeakSet()
_repaired: 'weakref.WeakSet[Repaired]' = weakref.WeakSet()
_held: list[Lock] = []


def lock() -> 'threading.Lock':
    """Return a new ``threading.Lock``."""
    return _added(threading.Lock())


def rlock() -> 'threading.RLock':
    """Return a new ``threading.RLock``."""
    return _added(threading.RLock())


def _added(made: _Made) -> _Made:
    with _known:
        _locks.add(made)
    return made


def repair(what: Repaired) -> None:
    """Repair an object in every child process, as long as the object exists."""
    with _known:
        _repaired.add(what)


def _acquire_all() -> None:
    """
    Acquire all locks, in spite of threads that hold several in any order.

    If a lock is not free for a while, its thread may be waiting for a lock that is held here: then
    all are released, and that lock is the first of the next attempt.
    """
    missing = _missing()
    deadline = time.monotonic() + _PATIENCE_S
    while missing:
        each = missing.pop()
        if each.acquire(timeout=_TURN_S):
            _held.append(each)
        elif time.monotonic() < deadline:
            _release(_held)
            missing += [*_held, each]
            _held.clear()
        else:
            # A child with a lock that stays locked is better than a parent that never forks.
            _known.acquire()
            return
        missing = missing or _missing()  # others may have been made in the meantime


def _missing() -> list[Lock]:
    """Return the locks that are not held yet; if there are none, keep ``_known`` locked."""
    _known.acquire()
    held = set(map(id, _held))
    missing = [each for each in _locks if id(each) not in held]
    if missing:
        _known.release()
    return missing


def _release(locks: list[Lock]) -> None:
    for each in locks:
        each.release()


def _release_all() -> None:
    _release(_held)
    _held.clear()
    _known.release()


def _begin_in_child() -> None:
    for each in list(_repaired):
        each.repair_in_child()
    _release_all()


if hasattr(os, 'register_at_fork'):
    os.register_at_fork(before=_acquire_all, after_in_parent=_release_all,
                        after_in_child=_begin_in_child)
