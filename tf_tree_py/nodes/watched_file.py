# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Detects edits of a file and of the files that it includes, without ROS."""

from collections.abc import Iterable
import os
from pathlib import Path

_State = tuple[int, int, int]


class WatchedFile:
    """
    Compares the times, sizes and inode numbers of files.

    Editors rewrite a file, replace it with another, or remove it for a moment. All of this is
    detected by polling, on any file system.

    :ivar path: the main file.
    """

    def __init__(self, path: str | Path) -> None:
        """Record the current state of the file."""
        self.path = Path(path)
        self._known: dict[Path, _State | None] = {self.path: _look(self.path)}

    def watch(self, files: Iterable[Path]) -> None:
        """Watch the main file and these others; recorded states are kept."""
        self._known = {file: self._known[file] if file in self._known else _look(file)
                       for file in dict.fromkeys((self.path, *files))}

    def has_changed(self) -> bool:
        """Return whether a file has changed since the last call; False while one is absent."""
        now = {file: _look(file) for file in self._known}
        changed = {file: state for file, state in now.items()
                   if state not in (None, self._known[file])}
        self._known.update(changed)
        return bool(changed)


def _look(path: Path) -> _State | None:
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
