# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The child processes of this process."""

from collections.abc import Sequence
import subprocess
from typing import Any

from tf_tree_py.nodes.bad_input import BadInput


class Children:
    """Processes that end with the ``with`` block, even after an exception."""

    def __init__(self) -> None:
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> 'Children':
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes.values():
            process.terminate()
        for process in self._processes.values():
            process.wait()

    def start(self, name: str, command: Sequence[str], **options: Any) -> None:
        """
        Start a process with the options of ``Popen``.

        It has its own session, so that only this process receives Ctrl-C, and then ends it.
        """
        self._processes[name] = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, start_new_session=True, **options)

    def check(self) -> None:
        """
        Check that all processes are running.

        :raises BadInput: one has ended; its output contains the reason.
        """
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise BadInput(f'the process of {name} ended with status {process.returncode}')
