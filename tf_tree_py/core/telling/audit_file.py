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

"""The audit of a program that knows nothing of it: written into a folder when it ends."""

import atexit
from itertools import count
import os
from pathlib import Path
import time

from .audit import Line, lines_of, LookupAudit, worst_first
from ..arrivals.observers import AUDIT_FOLDER
from ..tree.queries import Queries

_numbers = count()


def watch(buffer: Queries) -> None:
    """Audit a buffer's lookups until the process ends; then write them to the folder."""
    audit = LookupAudit(buffer, getattr(buffer, 'now', time.time_ns))
    buffer.observers.add(audit)
    path = Path(os.environ[AUDIT_FOLDER], f'{os.getpid()}-{next(_numbers)}.json')
    atexit.register(lambda: path.write_text(audit.as_json()))


def read(folder: Path) -> list[Line] | None:
    """Return what all programs wrote, the worst first; None: no buffer was made."""
    files = list(folder.glob('*.json'))
    return worst_first(line for file in files for line in lines_of(file.read_text())
                       ) if files else None
