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

"""What all pages look at: a tree, its clock, what is wrong with it, and how its robot looks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import threading
import time

from tf_tree_py.core.checks.finding import Finding
from tf_tree_py.core.tree.queries import Queries

from .shown.shapes import LinkShape

# To find out what is wrong takes longer than a picture; all pages share what was found.
_EVERY_S = 2.0


@dataclass
class Subject:
    """
    What there is to see.

    :ivar tree: a buffer that fills, or a recording.
    :ivar live: whether it goes on.
    :ivar now: the clock that its stamps go by, nanoseconds.
    :ivar diagnose: tells what is wrong with it.
    :ivar shapes: of the links of its robot.
    :ivar fixed_frame: what pages begin with; None: the root with the most frames below it.
    """

    tree: Queries
    live: bool
    now: Callable[[], int]
    diagnose: Callable[[], Sequence[Finding]] = tuple
    shapes: Sequence[LinkShape] = ()
    fixed_frame: str | None = None
    _findings: Sequence[Finding] = ()
    _asked: float = -_EVERY_S
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def findings(self) -> Sequence[Finding]:
        """Return what was wrong a moment ago."""
        with self._lock:
            if time.monotonic() - self._asked >= _EVERY_S:
                self._findings = self.diagnose()
                self._asked = time.monotonic()
            return self._findings
