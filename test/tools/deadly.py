# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A job that kills the worker that reads certain bags; workers import it from here."""

from dataclasses import dataclass
import os
from pathlib import Path
import signal

from tf_tree_py.tools.archive.jobs import Result


@dataclass(frozen=True)
class Deadly:
    """
    Returns an empty report, but never for a bag named ``bomb``, and for ``once`` the second time.

    :ivar tried: an initially empty folder, with a file for each attempt.
    """

    tried: Path

    def __call__(self, path, name):
        """Kill this process, or return a report."""
        attempts = len(list(self.tried.glob(f'{path.name}*')))
        (self.tried / f'{path.name} {attempts}').touch()
        if path.name == 'bomb' or (path.name == 'once' and not attempts):
            os.kill(os.getpid(), signal.SIGKILL)
        return Result({'outcome': 'fine', 'reason': ''}, {'.txt': path.name.encode()})
