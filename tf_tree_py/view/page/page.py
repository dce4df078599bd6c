# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One open page: its moment, its picture, its sensors and its controls."""

from collections import deque
from collections.abc import Callable, Sequence
import threading
from typing import Final

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.health.checks.finding import Finding
from tf_tree_py.limited_log import FailureLog
from viser import ClientHandle

from .browser import Browser, Film, film_stamps
from .controls import Address, Controls
from .framing import CameraControl, Framing
from ..model.facts import biggest_root, facts
from ..model.moment import Ellipsoid, ellipsoid, Moment, nothing, trail
from ..model.playhead import Playhead, time_of
from ..panels.sensors_panel import SensorsPanel
from ..scene.parts import Seen
from ..scene.scene import Appearance, Scene
from ..sensors.readings import Pixels, placed, Reading, Sensors
from ..subject import Subject

# The number of messages that make up a trail, such as that of an odometry.
_TRAIL: Final = 300


class SensorView:
    """
    Turns readings into points in the fixed frame and a picture.

    :ivar missing: what cannot be shown at the moment, one sentence each.
    """

    def __init__(self, sensors: Sensors, panel: SensorsPanel) -> None:
        self._sensors, self._panel = sensors, panel
        self.missing: list[str] = []
        self._image: Pixels | None = None

    def seen(self, tree: AllQueries, moment: Moment) -> dict[str, Seen]:
        """Return what each topic shows at a moment, by topic; show the picture of a camera."""
        self.missing, self._image = [], None
        seen = {topic: found for topic in self._panel.wanted()
                if (found := self._of_topic(tree, moment, topic)) is not None}
        self._panel.show_image(self._image)
        return seen

    def _of_topic(self, tree: AllQueries, moment: Moment, topic: str) -> Seen | None:
        reading = self._sensors.reading(topic, moment.stamp)
        if reading is None or reading.problem:
            problem = 'no message at or before this stamp' if reading is None else reading.problem
            self.missing.append(f'{topic}: {problem}')
            return None
        if reading.image is not None:
            self._image = reading.image
            return None
        if reading.is_line and len(reading.points) == 1:
            return self._trail(tree, moment, self._sensors.trail(topic, moment.stamp, _TRAIL))
        points = placed(tree, moment.fixed_frame, reading, self._panel.at_newest)
        if points is None:
            self.missing.append(f'{topic}: no transform from {reading.frame!r} at its stamp')
            return None
        return Seen(points, reading.is_line)

    def _trail(self, tree: AllQueries, moment: Moment, readings: Sequence[Reading]) -> Seen | None:
        """Return the positions of several messages, each at its own stamp, as one line."""
        newest = self._panel.at_newest
        placed_points = [placed(tree, moment.fixed_frame, reading, newest) for reading in readings]
        found: list[Array] = [points for points in placed_points if points is not None]
        return Seen(np.concatenate(found), True) if found else None


# --- the page

# Texts, lists and trails are updated less often than the picture.
_PANELS_EVERY_S: Final = 0.25


class Page:
    """
    A page that is open in a browser.

    Each page has its own time, fixed frame and chosen frame. ``tick`` and the events of the
    controls come from different threads, and a lock lets one of them work at a time.
    """

    def __init__(self, client: ClientHandle, subject: Subject, log: FailureLog) -> None:
        """
        Make the controls; ``tick`` draws the picture.

        :param client: viser's handle of the page.
        :param log: of actions that fail.
        """
        self._subject = subject
        self._log = log
        self._lock = threading.RLock()
        self._actions: deque[Callable[[], None]] = deque()
        self._look = Appearance()
        self._playhead = Playhead(subject.tree, subject.live)
        self._drawn = nothing('')
        self._needs_drawing = True
        self._camera_moved = True
        self._since_panels_s = _PANELS_EVERY_S
        self.controls = Controls(client.gui, subject, self._playhead, self._look, self,
                                 self._apply)
        self._browser = Browser(client, self._apply, self._open, self._resized)
        self._camera = CameraControl(client, lambda: self._browser.size, self._note_camera)
        self._framing = Framing(self._camera, self._look, self.controls.appearance)
        self._address = Address(self.controls, self._playhead, self._camera, self._look)
        self._sensors = SensorView(subject.sensors, self.controls.sensors)
        self._scene = Scene(client, lambda frame: self._apply(lambda: self.choose(frame)))
        self._film = Film(client, self._show)

    def _apply(self, action: Callable[[], None]) -> None:
        """
        Call an action between two pictures; the next picture shows its effect.

        Actions are called in the order of their events. The lock does not keep this order: while a
        picture is drawn, several events may wait for it, each in its own thread.
        """
        self._actions.append(action)
        with self._lock:
            while self._actions:
                self._needs_drawing = True
                action = self._actions.popleft()
                try:
                    action()
                except Exception:  # noqa: B902 - a client may send any value for a control
                    self._log.report('a control of a page')

    def _note_camera(self) -> None:
        # Without the lock, because this is called at every movement of the mouse.
        self._camera_moved = True

    # --- drawing

    def tick(self, seconds: float) -> None:
        """
        Draw the parts of the page that have changed.

        :param seconds: since the last call.
        """
        with self._lock:
            self._playhead.use(self._subject.tree, self._subject.live)
            self._playhead.advance(seconds)
            self._since_panels_s += seconds
            panels_are_due = self._needs_drawing or self._since_panels_s >= _PANELS_EVERY_S
            if self._browser.is_behind and not panels_are_due:
                return
            moment = self._playhead.moment(
                self._fixed_frame(), self._subject.now(), self._subject.left_behind)
            if panels_are_due or self._camera_moved or not _alike(moment, self._drawn):
                self._draw(moment)
            self._drawn = moment
            if panels_are_due:
                self._needs_drawing, self._since_panels_s = False, 0.0
                self._refresh_panels(moment)

    def _draw(self, moment: Moment) -> None:
        self._camera_moved = False
        self._framing.see_new(moment, self._subject.shapes)
        self._framing.hold(moment, self.controls.chosen.followed)
        self._look.chosen = self.controls.chosen.frame
        self._look.found = self.controls.findings.frames
        self._scene.links.show(self._subject.shapes)
        self._scene.draw(moment, self._look, self._ellipsoid(moment), self._camera.camera(),
                         self._sensors.seen(self._playhead.tree, moment))

    def _ellipsoid(self, moment: Moment) -> Ellipsoid | None:
        """Return the uncertainty of the chosen frame's position, if the frame is visible."""
        frame = self.controls.chosen.frame
        if frame is None or frame in self._look.hidden:
            return None
        return ellipsoid(self._playhead.tree, moment, frame)

    def _fixed_frame(self) -> str:
        chosen = self.controls.frames.fixed_frame
        if chosen is not None:
            return chosen
        # A new root may appear above the present one. Look for it as often as panels change.
        if (self._needs_drawing or self._since_panels_s >= _PANELS_EVERY_S
                or not self._drawn.frames):
            return biggest_root(AllQueries.edges(self._playhead.tree)) or ''
        return self._drawn.fixed_frame

    def _refresh_panels(self, moment: Moment) -> None:
        tree, controls = self._playhead.tree, self.controls
        chosen = controls.chosen.frame
        edges = tree.edges()
        stale = [moment.frames[place] for place in np.flatnonzero(moment.stale)]
        controls.timeline.refresh(moment, chosen, self._remark(moment), self._age_s(moment),
                                  self._subject.incidents.stamps())
        controls.frames.refresh(edges, moment.fixed_frame, stale, self._look.hidden, chosen)
        if chosen is not None:
            controls.chosen.refresh(facts(tree, edges, moment, chosen))
        controls.sensors.refresh(self._sensors.missing)
        controls.pictures.refresh(self._film.progress)
        controls.refresh(self._subject, self._playhead, moment)
        self._draw_trail(moment)
        self._browser.beat()
        self._browser.write(self._address.now(moment))

    def _age_s(self, moment: Moment) -> float | None:
        """Return the age of a live picture when the browser shows it; None if it is not live."""
        if not self._playhead.live or self._subject.rests:
            return None
        return max(self._subject.now() - moment.stamp, 0) / 1e9 + self._browser.late_s()

    def _remark(self, moment: Moment) -> str:
        """Return why the page is empty."""
        if moment.fixed_frame and self._playhead.tree.frames():
            return (f'{moment.fixed_frame!r} is not a frame of this tree: choose another fixed '
                    'frame')
        return 'waiting for transforms: does any node publish on /tf or /tf_static?'

    def _draw_trail(self, moment: Moment) -> None:
        frame = self.controls.chosen.trail
        oldest, newest = self._playhead.window()
        self._scene.draw_trail(
            np.empty((0, 2, 3)) if frame is None else
            trail(self._playhead.tree, moment.fixed_frame, frame, oldest, newest), self._look)

    def close(self) -> None:
        """Release what only this page uses."""
        self._film.stop()
        self.controls.sensors.close()

    # --- actions of the controls

    def choose(self, frame: str) -> None:
        """Choose a frame; if it is chosen already, choose none."""
        chosen = self.controls.chosen
        chosen.choose(None if frame == chosen.frame else frame)

    def see(self, everything: bool) -> None:
        """Turn the camera to all frames, or only to those of the robot."""
        self._framing.see(self._drawn, self._subject.shapes, everything)

    def look_at_chosen(self) -> None:
        """Turn the camera to the chosen frame."""
        frame = self.controls.chosen.frame
        place = None if frame is None else self._drawn.place(frame)
        if place is not None:
            self._camera.look_at(self._drawn.poses[place, :3] - self._look.origin)

    def go_to(self, finding: Finding) -> None:
        """Show the time of a finding, if it has one."""
        stamp = time_of(finding, self._playhead.tree, self._subject.incidents)
        if stamp is not None:
            self._playhead.seek(stamp)

    def save_picture(self) -> None:
        """Save the picture of the page as a file, without the controls."""
        self._browser.download_picture('tf_view.png')

    def record(self, seconds: float) -> None:
        """Record a film of so many seconds, or end the one that is being recorded."""
        size = self._browser.size
        if self._film.progress is not None:
            self._film.stop()
        elif size is not None and self._drawn.frames:
            playhead = self._playhead
            playhead.pause()
            self._film.start(film_stamps(playhead.window(), playhead.stamp, seconds,
                                         playhead.speed), size)

    def _show(self, stamp: int) -> None:
        """Draw the moment at a stamp at once."""
        with self._lock:
            self._playhead.seek(stamp)
            self._drawn = self._playhead.moment(self._fixed_frame(), self._subject.now())
            self._draw(self._drawn)

    def _open(self, query: str) -> None:
        camera = self._address.show(query)
        if camera is not None:
            self._framing.stand(camera)

    def _resized(self) -> None:
        self._framing.see_again()
        self._camera_moved = True


def _alike(moment: Moment, drawn: Moment) -> bool:
    """Return whether two moments look the same, except for the shade of stale frames."""
    return (moment.frames == drawn.frames
            and all(np.array_equal(ours, theirs) for ours, theirs in (
                (moment.poses, drawn.poses), (moment.parents, drawn.parents),
                (moment.stale, drawn.stale), (moment.static, drawn.static))))
