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

"""The processes that this one starts, and ends."""

from collections.abc import Sequence
import subprocess
from typing import Any

from tf_tree_py.nodes.bad_input import BadInput


class Children:
    """Processes that end with the ``with`` block, however that ends."""

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
        Start one; options as ``Popen`` takes them.

        In a session of its own, so that Ctrl-C reaches us alone, and we end it.
        """
        self._processes[name] = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, start_new_session=True, **options)

    def check(self) -> None:
        """
        See that all of them are there.

        :raises BadInput: one has ended; it will have said why.
        """
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise BadInput(f'the process of {name} ended with status {process.returncode}')
