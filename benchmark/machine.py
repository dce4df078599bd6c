# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A description of the machine that ran the benchmark."""

from collections.abc import Mapping
import datetime
import hashlib
import importlib.metadata
import os
from pathlib import Path
import platform
import subprocess
from typing import Any

from tf_tree_py.core import COMPILED

_REPOSITORY = Path(__file__).resolve().parent.parent


def describe(quick: bool) -> dict[str, Any]:
    """
    Return the machine, the versions, the time, and the current load.

    :param quick: whether the run has fewer rounds; it is part of the description.
    """
    return {
        'quick': quick,
        'commit': _commit(),
        'code': _code(),
        'compiled': COMPILED,
        'cpu': _cpu_model(),
        'cores': os.cpu_count(),
        'system': platform.platform(),
        'python': platform.python_version(),
        **{package: _version(package) for package in (
            'numpy', 'scipy', 'transform-tree', 'pytransform3d')},
        'rclpy': _rclpy_version(),
        'rmw': os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp'),
        'date': datetime.datetime.now(datetime.timezone.utc).isoformat(timespec='seconds'),
        'load_before': load(),
    }


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """
    Return what has changed since a run, so that it cannot be continued.

    :param before: its ``describe()``.
    :param now: the present one.
    """
    may_differ = {'commit', 'date', 'load_before'}
    return [name for name in now if name not in may_differ and now[name] != before.get(name)]


def load() -> list[float]:
    """Return the load averages of the last 1, 5 and 15 minutes."""
    return list(os.getloadavg())


def _commit() -> str | None:
    """Return the commit of tf_tree_py; None if git cannot determine it."""
    try:
        commit = _git('rev-parse', '--short', 'HEAD')
        changes = _git('status', '--porcelain', '--', 'tf_tree_py')
    except (OSError, subprocess.CalledProcessError):
        return None
    return f'{commit} with changes' if changes else commit


def _code() -> str:
    """Return a digest of tf_tree_py's code, with the changes that have no commit yet."""
    digest = hashlib.sha256()
    for file in sorted((_REPOSITORY / 'tf_tree_py').rglob('*.*')):
        if file.suffix in {'.py', '.c'}:
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _git(*arguments: str) -> str:
    return subprocess.run(['git', *arguments], cwd=_REPOSITORY, capture_output=True, text=True,
                          check=True).stdout.strip()


def _cpu_model() -> str:
    try:
        with open('/proc/cpuinfo') as file:
            for line in file:
                name, _, value = line.partition(':')
                if name.strip() == 'model name':
                    return value.strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _rclpy_version() -> str | None:
    return _version('rclpy') or _version('ros-jazzy-rclpy')


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None
