# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Remote calls to another process: a request and a response, each one line of JSON.

Uses the standard library only, because a contestant in another Python also imports this module.
"""

from collections.abc import Callable, Mapping, Sequence
import contextlib
import json
import os
import subprocess
import sys
import traceback
from typing import Any


class WorkerError(RuntimeError):
    """The other process failed; the message is its traceback."""


class Worker:
    """
    A process that runs ``serve``.

    It ends on ``close``. It also ends when this process ends, because its input closes.
    """

    def __init__(self, command: Sequence[str],
                 environment: Mapping[str, str] | None = None) -> None:
        """
        Start the process.

        :param environment: its complete environment; None: that of this process.
        """
        self._command = ' '.join(command)
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
            cwd=os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

    def call(self, verb: str, /, **arguments: Any) -> Any:
        """
        Call a function of the process, and wait for the result.

        :raises WorkerError: the function raised an exception, or the process has ended.
        """
        self.begin(verb, **arguments)
        return self.end()

    def begin(self, verb: str, /, **arguments: Any) -> None:
        """Call a function of the process without waiting; ``end`` waits for the result."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps([verb, arguments]) + '\n')
            self._process.stdin.flush()
        except BrokenPipeError:
            raise WorkerError(f'{self._command} has ended') from None

    def end(self) -> Any:
        """Return the result of the call that ``begin`` started."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise WorkerError(f'{self._command} ended with {self._process.wait()}')
        answer = json.loads(line)
        if 'error' in answer:
            raise WorkerError(answer['error'])
        return answer['value']

    @property
    def pid(self) -> int:
        """Return the id of the process."""
        return self._process.pid

    def kill(self) -> None:
        """Kill the process at once, as a power failure would."""
        self._process.kill()
        self.close()

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None and self._process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def __enter__(self) -> 'Worker':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def serve(verbs: Mapping[str, Callable[..., Any]]) -> None:
    """Serve the requests of a ``Worker`` until it closes the input."""
    # Other output must not be mistaken for a response.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), 'w')
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for line in sys.stdin:
        verb, arguments = json.loads(line)
        try:
            answer = {'value': verbs[verb](**arguments)}
        except Exception:  # noqa: B902 - the caller receives any exception
            answer = {'error': traceback.format_exc()}
        answers.write(json.dumps(answer) + '\n')
        answers.flush()
