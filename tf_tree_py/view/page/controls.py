# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All controls of one page."""

from typing import Protocol

from tf_tree_py.health.checks.finding import Finding

from ..model.moment import Moment
from ..model.playhead import Playhead
from ..panels.appearance_panel import AppearancePanel, JointsPanel, ViewButtons
from ..panels.control_events import Apply, GuiApi
from ..panels.frames_panel import ChosenPanel, FindingsPanel, FramesPanel
from ..panels.motion_panel import MotionPanel
from ..panels.sensors_panel import PicturesPanel, SensorsPanel
from ..panels.timeline import Timeline
from ..scene.scene import Appearance
from ..subject import Subject


class Actions(Protocol):
    """What a page does for its controls."""

    def choose(self, frame: str) -> None:
        """Choose a frame; if it is chosen already, choose none."""

    def see(self, everything: bool) -> None:
        """Turn the camera to all frames, or only to those of the robot."""

    def look_at_chosen(self) -> None:
        """Turn the camera to the chosen frame."""

    def go_to(self, finding: Finding) -> None:
        """Show the time of a finding."""

    def save_picture(self) -> None:
        """Save the picture of the page as a file."""

    def record(self, seconds: float) -> None:
        """Record a film of so many seconds, or end the one that is being recorded."""


class Controls:
    """The panel of one page, with its tabs."""

    def __init__(self, gui: GuiApi, subject: Subject, playhead: Playhead, look: Appearance,
                 actions: Actions, apply: Apply) -> None:
        gui.main_panel.dock_right()
        self.timeline = Timeline(gui, playhead, subject.name, apply)
        ViewButtons(gui, actions.see, apply)
        self.joints = (None if subject.resting is None else
                       JointsPanel(gui, subject.resting, apply))
        tabs = gui.add_tab_group()
        with tabs.add_tab('frames'):
            self.frames = FramesPanel(gui, subject.fixed_frame, actions.choose, apply)
        with tabs.add_tab('chosen'):
            self.chosen = ChosenPanel(gui, look.hidden, actions.look_at_chosen, apply)
            self.motion = MotionPanel(gui, apply)
        with tabs.add_tab('sensors'):
            self.sensors = SensorsPanel(gui, subject.sensors, apply)
        with tabs.add_tab('findings'):
            self.findings = FindingsPanel(gui, actions.go_to, apply)
        with tabs.add_tab('look'):
            self.appearance = AppearancePanel(gui, look, apply)
            self.pictures = PicturesPanel(gui, actions.save_picture, actions.record, apply)

    def refresh(self, subject: Subject, playhead: Playhead, moment: Moment) -> None:
        """Update all controls except those of time, frames and the chosen frame."""
        self.findings.refresh(subject.findings())
        self.appearance.refresh(subject.missing)
        self.motion.refresh(playhead, moment, self.chosen.frame)
        if self.joints is not None:
            self.joints.refresh(subject.rests)
