# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Exercises in another process, for contestants that this one cannot import.

Uses the standard library only, because a contestant in another Python also imports this module.
"""

from collections.abc import Callable, Mapping
import itertools
from typing import Any

from ..exercise import Exercise, Peer, Task
from ..worker import serve, Worker


class RemotePeer:
    """
    A process that runs ``serve_exercises``.

    :ivar worker: the process.
    """

    def __init__(self, worker: Worker) -> None:
        self.worker = worker
        self._names = map(str, itertools.count())

    def exercise(self, task: Task) -> 'RemoteExercise':
        """Return an exercise that runs in the process."""
        return RemoteExercise(self.worker, next(self._names), task)


class RemoteExercise:
    """``exercise.Exercise``, run by a worker."""

    def __init__(self, worker: Worker, name: str, task: Task) -> None:
        self._worker = worker
        self._name = name
        worker.call('begin', name=name, task=list(task))

    def __getattr__(self, verb: str) -> Any:
        """Return a function that calls the worker's verb on this exercise."""
        return lambda **arguments: self._worker.call(verb, name=self._name, **arguments)


def serve_exercises(make: Callable[[], Peer], more: Mapping[str, Callable[..., Any]] | None = None
                    ) -> None:
    """
    Serve the exercises of a ``RemotePeer`` until it closes.

    :param make: makes the contestant of an exercise.
    :param more: other verbs that the process serves.
    """
    exercises: dict[str, Exercise] = {}

    def begin(name: str, task: list[Any]) -> None:
        exercises[name] = Exercise(make(), Task(*task))

    serve({
        'begin': begin,
        'answers': lambda name: exercises[name].answers(),
        'take_turn': lambda name: exercises[name].take_turn(),
        'change': lambda name, **task: exercises[name].change(**task),
        'loop': lambda name, stamps: exercises[name].loop(stamps),
        'answer': lambda name, stamp: exercises[name].answer(stamp),
        'insertions': lambda name, batches: exercises[name].insertions(batches),
        **(more or {}),
    })
