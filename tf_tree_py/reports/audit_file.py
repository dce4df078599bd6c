# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The audit of an unchanged program, written to a folder when the program ends."""

import atexit
from itertools import count
import os
from pathlib import Path
import time

from tf_tree_py.core.messages.observers import AUDIT_FOLDER
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.core.whole_files import write_whole

from .audit import Line, lines_of, LookupAudit, worst_first

_numbers = count()


def watch(buffer: Queries) -> None:
    """Audit a buffer's lookups until the process ends, then write the audit to the folder."""
    audit = LookupAudit(buffer, getattr(buffer, 'now', time.time_ns))
    buffer.observers.add(audit)
    path = Path(os.environ[AUDIT_FOLDER], f'{os.getpid()}-{next(_numbers)}.json')
    atexit.register(lambda: write_whole(path, [audit.as_json().encode()]))


def read(folder: Path) -> list[Line] | None:
    """Return the lines of all programs, the worst first; None if no buffer was made."""
    files = list(folder.glob('*.json'))
    return worst_first(line for file in files for line in lines_of(file.read_text())
                       ) if files else None
