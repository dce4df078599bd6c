"""Whether somebody has edited a file; no ROS."""

import os
from pathlib import Path


class WatchedFile:
    """
    Knows a file by its time, its size and its number.

    Editors write a file anew, put another in its place, or take it away for a moment: all of
    that is seen when somebody asks, whatever the file system tells of it.

    :ivar path: where it is.
    """

    def __init__(self, path: str | Path) -> None:
        """Remember how the file is now."""
        self.path = Path(path)
        self._known = self._look()

    def has_changed(self) -> bool:
        """Return whether it is another than when this was asked last; no while it is away."""
        now = self._look()
        changed = now not in (None, self._known)
        if changed:
            self._known = now
        return changed

    def _look(self) -> tuple[int, int, int] | None:
        try:
            status = os.stat(self.path)
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino
