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

"""
Asking another process to do something: a line of JSON there, a line of JSON back.

Standard library only, for a contestant in another Python imports this too.
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
    A process that ``serve``s.

    It ends with ``close``, and also when this process does: its input closes.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None
                 ) -> None:
        """
        Start it.

        :param environment: all of it; None for this process's own.
        """
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
            cwd=os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

    def call(self, verb: str, /, **arguments: Any) -> Any:
        """
        Let it do something, and wait for the answer.

        :raises WorkerError: it raised, or is gone.
        """
        self.begin(verb, **arguments)
        return self.end()

    def begin(self, verb: str, /, **arguments: Any) -> None:
        """Let it do something meanwhile; ``end`` waits for the answer."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps([verb, arguments]) + '\n')
            self._process.stdin.flush()
        except BrokenPipeError:
            raise WorkerError(f'{self._process.args} has ended') from None

    def end(self) -> Any:
        """Return the answer to ``begin``."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise WorkerError(f'{self._process.args} ended with {self._process.wait()}')
        answer = json.loads(line)
        if 'error' in answer:
            raise WorkerError(answer['error'])
        return answer['value']

    def close(self) -> None:
        """End it."""
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
    """Answer what a ``Worker`` asks until it closes the input."""
    # What else prints is not to be taken for an answer.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), 'w')
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for line in sys.stdin:
        verb, arguments = json.loads(line)
        try:
            answer = {'value': verbs[verb](**arguments)}
        except Exception:  # noqa: B902 - the one who asked is to know, whatever it is
            answer = {'error': traceback.format_exc()}
        answers.write(json.dumps(answer) + '\n')
        answers.flush()
