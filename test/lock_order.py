# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Which locks a thread holds while it takes another one, and which of these docs/design.md allows.

A program calls ``record`` before it imports the package or rclpy. Then their locks note what the
thread holds when it waits for them. An order that two threads could take the other way round is
found even if they do not meet.
"""

import _thread
import ast
from collections.abc import Callable, Iterator
import faulthandler
import json
import linecache
import os
from pathlib import Path
import re
import sys
import threading
import traceback
from types import FrameType
from typing import Any

from programs import completed, PATIENCE_S

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = REPOSITORY / 'tf_tree_py'

# The names of two locks: that which is held, and that which is taken.
Pair = tuple[str, str]

INNERMOST = 'fork_locks._known'
"""Any thread may take it: to make a lock, and during a fork."""

_WATCHED = ('tf_tree_py', 'rclpy')
_BETWEEN = (threading.__file__, str(PACKAGE / 'core' / 'fork_locks.py'), __file__)
# ``self._lock = ...``, ``_lock: Any = ...``
_TARGET = re.compile(r'(\w+)(?:: [^=]+)? = ')


class _Held(threading.local):
    """The locks that a thread holds, in the order in which it took them."""

    def __init__(self) -> None:
        self.locks: list[Lock] = []


_held = _Held()
noted: dict[Pair, str] = {}


class Lock:
    """
    A lock of ``threading`` that notes what the thread holds when it takes the lock.

    A thread that gives up after a time does not wait without end, so its wait is not noted. To
    take a lock without waiting is to raise a flag.
    """

    def __init__(self, lock: Any, name: str) -> None:
        self._lock, self.name = lock, name

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        if blocking and timeout < 0:
            self._note()
        taken = self._lock.acquire(blocking, timeout)
        if taken and blocking:
            _held.locks.append(self)
        return bool(taken)

    def release(self) -> None:
        self._lock.release()
        if self in _held.locks:
            _held.locks.remove(self)

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    def locked(self) -> bool:
        return bool(self._lock.locked())

    def _note(self) -> None:
        if self in _held.locks:  # once more
            return
        for held in _held.locks:
            pair = held.name, self.name
            if pair not in noted:
                noted[pair] = ''.join(traceback.format_stack(limit=14)[:-2])


class RLock(Lock):
    """The same of a re-entrant lock, with the methods that a ``Condition`` calls."""

    def _is_owned(self) -> bool:
        return bool(self._lock._is_owned())

    def _release_save(self) -> Any:
        count = _held.locks.count(self)
        _held.locks[:] = [held for held in _held.locks if held is not self]
        return self._lock._release_save(), count

    def _acquire_restore(self, state: Any) -> None:
        self._note()
        self._lock._acquire_restore(state[0])
        _held.locks += [self] * state[1]


def record() -> None:
    """
    Note from now on in which order the package, and rclpy, take the locks that they make.

    If their threads wait for each other, the program prints their stacks, and ends.
    """
    faulthandler.dump_traceback_later(PATIENCE_S - 60.0, exit=True)
    assert 'tf_tree_py' not in sys.modules, 'too late: its locks exist already'
    threading.Lock = _making(_thread.allocate_lock, Lock)  # type: ignore[assignment]
    threading.RLock = _making(_thread.RLock, RLock)  # type: ignore[assignment]


def print_pairs() -> None:
    """Print what was noted, for ``observed_by``."""
    print(json.dumps([[*pair, stack] for pair, stack in noted.items()]))


def observed_by(program: Path) -> dict[Pair, str]:
    """Run a program; return the pairs that it noted, each with the stack of its first time."""
    done = completed(sys.executable, program,
                     env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stdout + done.stderr
    last = done.stdout.splitlines()[-1]
    return {(held, taken): stack for held, taken, stack in json.loads(last)}


def _making(make: Callable[[], Any], cls: type[Lock]) -> Callable[[], Any]:
    def made() -> Any:
        name = _name(sys._getframe(1))
        return make() if name is None else cls(make(), name)

    return made


def _name(frame: FrameType | None) -> str | None:
    """Return the name of the lock that is being made; None: it is none of ours."""
    while frame is not None and frame.f_code.co_filename in _BETWEEN:
        code = frame.f_code
        if code.co_filename == threading.__file__ and not isinstance(
                frame.f_locals.get('self'), threading.Condition):
            return None  # inside an Event: only the standard library's own code runs with it held
        if code.co_name == '<module>':
            break
        frame = frame.f_back
    module = '' if frame is None else frame.f_globals.get('__name__', '')
    if frame is None or module.partition('.')[0] not in _WATCHED:
        return None
    if not module.startswith('tf_tree_py'):
        return '.'.join(module.split('.')[:2])  # what rclpy calls its locks differs by release
    target = _TARGET.search(linecache.getline(frame.f_code.co_filename, frame.f_lineno))
    assert target is not None, f'{frame.f_code.co_filename}:{frame.f_lineno} names no lock'
    return f'{_owner(frame, module)}.{target[1]}'


def _owner(frame: FrameType, module: str) -> str:
    """Return the class that made a lock, which an object's class may inherit, or its module."""
    code = frame.f_code
    for cls in type(frame.f_locals.get('self')).__mro__:
        if getattr(vars(cls).get(code.co_name), '__code__', None) is code:
            return cls.__name__
    return module.rpartition('.')[2]


# --- the documented order

def documented() -> dict[str, set[str]]:
    """Return for each lock in docs/design.md the names of those that its holder may take."""
    text = (REPOSITORY / 'docs' / 'design.md').read_text(encoding='utf-8')
    table = text.partition('<!-- locks -->')[2].partition('<!-- end of locks -->')[0]
    rows = [line.split(' | ') for line in table.splitlines() if line.startswith('| `')]
    return {name: set(_names(row[2])) for row in rows for name in _names(row[0])}


def undocumented(pairs: dict[Pair, str]) -> str:
    """Return the pairs that the table does not have, with their stacks; '' if it has all."""
    table = documented()
    return '\n'.join(
        f'{held} was held when {taken} was taken:\n{stack}'
        for (held, taken), stack in pairs.items()
        if not (held.startswith('rclpy.') and taken.startswith('rclpy.'))
        and taken not in table.get(held, set())
        and (taken != INNERMOST or held not in table))


def _names(cell: str) -> list[str]:
    return re.findall(r'`([\w.]+)`', cell)


def made_in_package() -> set[str]:
    """Return the names of all locks that the code of the package makes."""
    return {name for path in PACKAGE.rglob('*.py')
            for name in _made(ast.parse(path.read_bytes()), path.stem)
            if name not in ('fork_locks.lock', 'fork_locks.rlock')}


def _made(tree: ast.AST, owner: str) -> Iterator[str]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
            if any(map(_makes_lock, ast.walk(node.value))):
                yield f'{owner}.{getattr(target, "attr", None) or getattr(target, "id", "")}'
        yield from _made(node, node.name if isinstance(node, ast.ClassDef) else owner)


def _makes_lock(node: ast.AST) -> bool:
    """Return whether a node is a call that makes a lock; a Condition may be given one."""
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
        return False
    of = ast.unparse(node.func)
    return of in ('threading.Lock', 'threading.RLock', 'fork_locks.lock', 'fork_locks.rlock') or (
        of == 'threading.Condition' and not node.args)
