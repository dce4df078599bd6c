# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
All controls of one page, and its address, which contains the moment, the frames and the camera.

Reloads and links therefore show the same. Names may contain any character. Characters other than
plain letters are written as ~ and the hexadecimal digits of their bytes, because the browser
writes values as they are.
"""

from dataclasses import dataclass
import re
from typing import Protocol
from urllib.parse import parse_qs

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.health.checks.finding import Finding

from .framing import CameraControl
from ..model.moment import Moment
from ..model.playhead import Playhead
from ..panels.appearance_panel import AppearancePanel, JointsPanel, ViewButtons
from ..panels.control_events import Apply, GuiApi
from ..panels.frames_panel import ChosenPanel, FindingsPanel, FramesPanel
from ..panels.sensors_panel import MotionPanel, PicturesPanel, SensorsPanel
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


# --- the address

_PLAIN = re.compile(rb'[^A-Za-z0-9_./-]')
_ESCAPED = re.compile(rb'~([0-9a-f]{2})')


@dataclass
class ViewLink:
    """
    What a page shows.

    :ivar stamp: of the moment, nanoseconds; None: the newest moment, or that of the opening.
    :ivar fixed_frame: None: the default.
    :ivar chosen: the chosen frame; None: no frame is chosen.
    :ivar camera: (2, 3) its position and the point at which it looks, in the fixed frame,
        metres; None: the default view of the robot.
    :ivar dark: whether the page is dark.
    """

    stamp: int | None = None
    fixed_frame: str | None = None
    chosen: str | None = None
    camera: Array | None = None
    dark: bool = False

    def query(self) -> str:
        """Return the query of an address."""
        parts = {
            't': None if self.stamp is None else _seconds(self.stamp),
            'fixed': self.fixed_frame and _escaped(self.fixed_frame),
            'chosen': self.chosen and _escaped(self.chosen),
            'camera': None if self.camera is None else '_'.join(
                f'{value:.4f}' for value in self.camera.ravel()),
            'dark': '1' if self.dark else None,
        }
        return '&'.join(f'{name}={value}' for name, value in parts.items() if value)

    @classmethod
    def parse(cls, query: str) -> 'ViewLink':
        """Return what a query describes. Invalid parts are ignored."""
        parts = {name: values[-1] for name, values in parse_qs(query.lstrip('?')).items()}
        return cls(_stamp(parts.get('t', '')), _name(parts.get('fixed', '')),
                   _name(parts.get('chosen', '')), _camera(parts.get('camera', '')),
                   parts.get('dark') == '1')


def _seconds(stamp: int) -> str:
    whole, rest = divmod(stamp, 1_000_000_000)
    return f'{whole}.{rest:09d}'


def _stamp(text: str) -> int | None:
    match = re.fullmatch(r'(\d{1,10})(?:\.(\d{1,9}))?', text, re.ASCII)
    if match is None:
        return None
    return int(match[1]) * 1_000_000_000 + int((match[2] or '').ljust(9, '0'))


def _escaped(name: str) -> str:
    return _PLAIN.sub(lambda match: b'~%02x' % match[0][0], name.encode()).decode()


def _name(text: str) -> str | None:
    raw = _ESCAPED.sub(lambda match: bytes([int(match[1], 16)]), text.encode())
    return raw.decode(errors='replace') or None


def _camera(text: str) -> Array | None:
    try:
        camera = np.array([float(part) for part in text.split('_')]).reshape(2, 3)
    except ValueError:
        return None
    return camera if np.isfinite(camera).all() and np.ptp(camera, axis=0).any() else None


# --- the address

class Address:
    """Converts what a page shows to the query of an address, and back."""

    def __init__(self, controls: Controls, playhead: Playhead, camera: CameraControl,
                 look: Appearance) -> None:
        self._controls, self._playhead = controls, playhead
        self._camera, self._look = camera, look

    def now(self, moment: Moment) -> str:
        """Return the query for the page as it is; without the camera if no person moved it."""
        camera = None if self._camera.is_untouched else self._camera.camera()
        return ViewLink(
            None if self._playhead.live or not moment.stamp else moment.stamp,
            self._controls.frames.fixed_frame, self._controls.chosen.frame,
            None if camera is None else
            np.array((camera.position, camera.look_at)) + self._look.origin,
            self._look.dark).query()

    def show(self, query: str) -> Array | None:
        """
        Show what a query describes.

        :return: (2, 3) the camera's position and the point at which it looks, in the fixed
            frame, metres; None: the query has no camera.
        """
        link = ViewLink.parse(query)
        if link.fixed_frame is not None:
            self._controls.frames.fixed_frame = link.fixed_frame
        if link.chosen is not None:
            self._controls.chosen.choose(link.chosen)
        if link.stamp is not None:
            self._playhead.seek(link.stamp)
        if link.dark != self._look.dark:
            self._controls.appearance.set_dark(link.dark)
        return link.camera
