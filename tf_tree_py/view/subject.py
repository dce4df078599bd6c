# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What all pages show: a tree, its clock, its findings, its robot and its sensors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import threading
import time

from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.health.checks.finding import Finding

from .model.moment import LeftBehind
from .model.playhead import IncidentLog
from .robot.resting_robot import RestingRobot
from .robot.shapes import LinkShape
from .sensors.readings import Sensors

# A check takes longer than a picture. All pages share its findings.
_EVERY_S = 2.0


@dataclass
class Subject:
    """
    What the pages show.

    :ivar buffer: of a running system, or a recording.
    :ivar live: whether new transforms arrive in the buffer.
    :ivar now: the clock of the stamps, nanoseconds.
    :ivar diagnose: returns the findings of a check.
    :ivar shapes: the shapes of the robot's links. When they change, this is a new object.
    :ivar fixed_frame: the frame in which new pages draw; None: the root with the most frames
        below it.
    :ivar name: of the input, for the title of the pages.
    :ivar missing: what of the robot is ignored or cannot be shown, one sentence each.
    :ivar incidents: the samples that were refused or odd.
    :ivar resting: the robot that pages show until transforms arrive; None: there is no
        description.
    :ivar sensors: the sensor messages.
    :ivar left_behind: returns the edges of a live tree that have stopped; None: by the stamps.
    """

    buffer: AllQueries
    live: bool
    now: Callable[[], int]
    diagnose: Callable[[], Sequence[Finding]] = tuple
    shapes: Sequence[LinkShape] = ()
    fixed_frame: str | None = None
    name: str = ''
    missing: Sequence[str] = ()
    incidents: IncidentLog = field(default_factory=IncidentLog)
    resting: RestingRobot | None = None
    sensors: Sensors = field(default_factory=Sensors)
    left_behind: LeftBehind | None = None
    _findings: Sequence[Finding] = ()
    _asked: float = -_EVERY_S
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def rests(self) -> bool:
        """Return whether the robot is shown at rest because no transforms have arrived."""
        return self.resting is not None and not self.buffer.frames()

    @property
    def tree(self) -> AllQueries:
        """Return the tree that the pages show now."""
        return self.resting.buffer if self.resting is not None and self.rests else self.buffer

    def findings(self) -> Sequence[Finding]:
        """Return the findings of the last check, which is at most two seconds old."""
        with self._lock:
            if time.monotonic() - self._asked >= _EVERY_S:
                self._findings = self.diagnose()
                self._asked = time.monotonic()
            return self._findings
