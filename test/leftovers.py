# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a test must leave as it was, because the tests after it in the same process share it.

Which files share a process differs from run to run, so whatever one test leaves behind makes
another one fail now and then. ``conftest.py`` compares this state around each test and each file.
The filters of warnings are not here: pytest itself restores them after each test.
"""

from collections.abc import Callable
from contextlib import suppress
import locale
import logging
import os
from pathlib import Path
import random
import sys
import threading
from types import ModuleType
from typing import Any

from conditions import until
import numpy as np

# By kind: what there is of it, by name.
State = dict[str, dict[str, Any]]

# The beginnings of their names: the thread of a buffer's timeouts ends by itself, a second after
# the last of them; dask has one thread for the whole process.
_LINGERING = ('tf_tree_py alarms', 'Dask-Offload')
# The socket that reserves a domain until the process ends (domains.py).
_CLAIM = '@tf_tree_py tests'
# pytest sets it for each phase of a test.
_OF_PYTEST = 'PYTEST_CURRENT_TEST'
# conftest.py selects it by a variable of the environment.
_BACKEND = ('backend', 'backend_fallback')
# Loggers of packages that set them when they are imported.
_SET_WHEN_IMPORTED = ('lark', 'distributed')
_NONE = 'none'
_PATIENCE_S = 10.0
# What may be new after a test: it was imported.
_MAY_COME = ('modules',)
# What may be gone: somebody was tidy.
_MAY_GO = ('sockets', 'sockets of DDS', 'threads')


def seed() -> None:
    """Let whatever draws numbers without a seed of its own draw the same ones in every order."""
    random.seed(0)
    np.random.seed(0)  # noqa: NPY002 - it is this generator that is shared


def forget() -> None:
    """Empty the caches of the package: what they hold may depend on the tests of one file."""
    for _, module in _modules():
        for value in list(vars(module).values()):
            if callable(clear := getattr(value, 'cache_clear', None)):
                clear()


def state_of_test() -> State:
    """Return what each test must leave as it was."""
    return {
        'settings of the process': {
            'working folder': _folder(),
            'mask of new files': _umask(),
            'locale': locale.setlocale(locale.LC_ALL),
            'switch interval': sys.getswitchinterval(),
            'sys.excepthook': sys.excepthook,
            'sys.unraisablehook': sys.unraisablehook,
            'threading.excepthook': threading.excepthook,
            'sys.path': tuple(dict.fromkeys(sys.path)),
        },
        'environment': {name: value for name, value in os.environ.items() if name != _OF_PYTEST},
        'errors of numpy': np.geterr(),
        'print options of numpy': np.get_printoptions(),
        'modules': {name: id(module) for name, module in _modules()},
        'loggers': _loggers(),
        'settings of matplotlib': _settings_of_matplotlib(),
        'figures of pyplot': _figures(),
        'ROS': _ros(),
        # A participant that was not destroyed ends only when garbage is collected.
        'sockets of DDS': _sockets('udp'),
    }


def state_of_file() -> State:
    """Return what each file must leave as it was: the same, threads and all sockets."""
    return {**state_of_test(), 'threads': _threads(),
            'sockets': _sockets('udp', 'udp6', 'tcp', 'tcp6', 'unix')}


def differences(before: State, after: State) -> list[str]:
    """Return what was left, as sentences; nothing, if all is as it was."""
    return [f'{kind}: {name}: {was.get(name, _NONE)!r} -> {now.get(name, _NONE)!r}'
            for kind, was in before.items() for now in [after[kind]]
            for name in dict.fromkeys([*was, *now])
            if (name in was or kind not in _MAY_COME) and (name in now or kind not in _MAY_GO)
            if was.get(name, _NONE) != now.get(name, _NONE)]


def left_behind(before: State, state: Callable[[], State]) -> list[str]:
    """
    Return what was left, as ``differences`` does, once nothing ends by itself any more.

    A thread that holds a node, such as one that spins it, may end a moment after its test.
    """
    left = differences(before, state())

    def have_ended() -> bool:
        nonlocal left
        left = differences(before, state())
        return not any(each.startswith(_MAY_GO) for each in left)

    if left:
        with suppress(AssertionError):
            until(have_ended, _PATIENCE_S)
    return left


def _modules() -> list[tuple[str, ModuleType]]:
    return [(name, module) for name, module in sys.modules.items()
            if name.startswith('tf_tree_py') and module is not None]


def _folder() -> str:
    try:
        return os.getcwd()
    except FileNotFoundError:
        return 'a folder that was removed'


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _loggers() -> dict[str, Any]:
    """
    Return what was set of each logger.

    Some packages set theirs when they are imported, and only theirs: they import others. Many add
    a handler then that does nothing.
    """
    every = {'root': logging.root, **logging.root.manager.loggerDict}
    made = {name: (one.level, _that_act(one.handlers), one.propagate, one.disabled)
            for name, one in every.items() if isinstance(one, logging.Logger)
            and not name.startswith(_SET_WHEN_IMPORTED)}
    return {name: one for name, one in made.items() if one != (logging.NOTSET, (), True, False)}


def _that_act(handlers: list[logging.Handler]) -> tuple[logging.Handler, ...]:
    return tuple(one for one in handlers if not isinstance(one, logging.NullHandler))


def _settings_of_matplotlib() -> dict[str, Any]:
    """Return what differs from the settings with which matplotlib was imported, if it was."""
    matplotlib = sys.modules.get('matplotlib')
    if not hasattr(matplotlib, 'rcParamsOrig'):  # it is not, or not completely
        return {}
    return {name: value for name, value in dict.items(matplotlib.rcParams)
            if value != dict.get(matplotlib.rcParamsOrig, name) and name not in _BACKEND}


def _figures() -> dict[str, Any]:
    pyplot = sys.modules.get('matplotlib.pyplot')
    return dict.fromkeys(pyplot.get_fignums()) if hasattr(pyplot, 'get_fignums') else {}


def _ros() -> dict[str, bool]:
    """Return whether rclpy is initialized, where it is loaded."""
    ros = sys.modules.get('rclpy')
    return {'rclpy is initialized': True} if hasattr(ros, 'ok') and ros.ok() else {}


def _sockets(*protocols: str) -> dict[str, str]:
    """
    Return the sockets of some kinds that have an address, with the port of those that have one.

    Fast DDS keeps three that have no address, from the first participant of a process.
    """
    own = {link.removeprefix('socket:[').removesuffix(']')
           for link in map(_link, os.listdir('/proc/self/fd')) if link.startswith('socket:')}
    found = {}
    for protocol in protocols:
        for line in _lines(f'/proc/net/{protocol}'):
            words = line.split()
            if _CLAIM not in line and (inode := own.intersection(words)):
                port = '' if protocol == 'unix' else f'port {int(words[1].partition(":")[2], 16)}'
                found[f'{protocol} {inode.pop()}'] = port
    return found


def _link(descriptor: str) -> str:
    try:
        return os.readlink(f'/proc/self/fd/{descriptor}')
    except FileNotFoundError:  # the one that listed the folder
        return ''


def _lines(file: str) -> list[str]:
    try:
        return Path(file).read_text(encoding='utf-8').splitlines()
    except FileNotFoundError:  # without IPv6
        return []


def _threads() -> dict[str, None]:
    return dict.fromkeys(_name(thread) for thread in threading.enumerate()
                         if not thread.name.startswith(_LINGERING))


def _name(thread: threading.Thread) -> str:
    return f'{thread.name} ({thread.ident})'
