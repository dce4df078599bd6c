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

"""What kills the worker that reads certain bags; workers import it from here."""

from dataclasses import dataclass
import os
from pathlib import Path
import signal

from tf_tree_py.tools.archive.jobs import Result


@dataclass(frozen=True)
class Deadly:
    """
    Returns an empty report, but of a bag named ``bomb`` never, and of ``once`` the second time.

    :ivar tried: an empty folder; has a file for each attempt.
    """

    tried: Path

    def __call__(self, path, name):
        """Kill this process, or do not."""
        attempts = len(list(self.tried.glob(f'{path.name}*')))
        (self.tried / f'{path.name} {attempts}').touch()
        if path.name == 'bomb' or (path.name == 'once' and not attempts):
            os.kill(os.getpid(), signal.SIGKILL)
        return Result({'outcome': 'fine', 'reason': ''}, {'.txt': path.name.encode()})
