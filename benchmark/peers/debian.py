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

"""Debian's python3-tf2, driven from here: its Python is the system's, so it is a process."""

import itertools
import os
from typing import Any

from ..exercise import Task
from ..worker import Worker, WorkerError

APT_LINE = 'sudo apt install python3-tf2 python3-tf2-ros'

_SYSTEM_PYTHON = '/usr/bin/python3'


class Debian:
    """The process; see ``debian_worker``."""

    def __init__(self) -> None:
        """
        Start it.

        :raises WorkerError: python3-tf2 is not installed.
        """
        self.worker = _start()
        self._names = map(str, itertools.count())

    def exercise(self, task: Task) -> 'RemoteExercise':
        """Return an exercise that the process does."""
        return RemoteExercise(self.worker, next(self._names), task)

    def alone(self, verb: str, **arguments: Any) -> Any:
        """Let a process of its own do something."""
        with _start() as worker:
            return worker.call(verb, **arguments)


class RemoteExercise:
    """``exercise.Exercise``, done by a worker."""

    def __init__(self, worker: Worker, name: str, task: Task) -> None:
        self._worker = worker
        self._name = name
        worker.call('begin', name=name, task=list(task))

    def __getattr__(self, verb: str) -> Any:
        """Return what calls the worker's verb on this exercise."""
        return lambda **arguments: self._worker.call(verb, name=self._name, **arguments)


def _start() -> Worker:
    # Nothing of the ROS 2 environment is for the system's Python.
    environment = {name: os.environ[name] for name in ('PATH', 'HOME') if name in os.environ}
    return Worker([_SYSTEM_PYTHON, '-m', 'benchmark.peers.debian_worker'], environment)


def find() -> Debian:
    """
    Return the process.

    :raises ImportError: with what to do about it.
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
