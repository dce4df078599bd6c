# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Debian's python3-tf2, run in a process because it needs the system's Python."""

import os
from typing import Any

from .remote import RemotePeer
from ..worker import Worker, WorkerError

APT_LINE = 'sudo apt install python3-tf2 python3-tf2-ros'

_SYSTEM_PYTHON = '/usr/bin/python3'


class Debian(RemotePeer):
    """The process; see ``debian_worker``."""

    def __init__(self) -> None:
        """
        Start the process.

        :raises WorkerError: python3-tf2 is not installed.
        """
        super().__init__(_start())

    def alone(self, verb: str, **arguments: Any) -> Any:
        """Call one function in a new process."""
        with _start() as worker:
            return worker.call(verb, **arguments)


def _start() -> Worker:
    # The system's Python must not use anything of the ROS 2 environment.
    environment = {name: os.environ[name] for name in ('PATH', 'HOME') if name in os.environ}
    return Worker([_SYSTEM_PYTHON, '-m', 'benchmark.peers.debian_worker'], environment)


def find() -> Debian:
    """
    Return the process.

    :raises ImportError: it is not installed; the message contains the remedy.
    """
    if not os.path.exists(_SYSTEM_PYTHON):
        raise ImportError(f'there is no {_SYSTEM_PYTHON}')
    debian = Debian()
    try:
        debian.worker.call('begin', name='probe', task=['chain1', 1.0, False, 1])
    except WorkerError as error:
        debian.worker.close()
        raise ImportError(f'not installed: {APT_LINE}') from error
    return debian
