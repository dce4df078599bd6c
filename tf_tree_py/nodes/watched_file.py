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
