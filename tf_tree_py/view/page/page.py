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

"""One page: where it is in time, what it shows, and what somebody does there."""

from collections.abc import Callable
import threading
from typing import Any, Final

import numpy as np
from tf_tree_py.core.tree.queries import Queries

from .chosen_panel import ChosenPanel
from .findings_panel import FindingsPanel
from .frames_panel import FramesPanel
from .look_panel import LookPanel
from .scene import Look, Scene
from .timeline import Timeline
from ..shown.ellipsoid import Ellipsoid, ellipsoid
from ..shown.facts import facts
from ..shown.listing import biggest_root
from ..shown.moment import Moment, nothing
from ..shown.playhead import Playhead
from ..shown.trail import trail
from ..subject import Subject

# Words, lists and trails need not follow every picture.
_TELL_EVERY_S: Final = 0.25


class Page:
    """
    A page that somebody has opened.

    It has a time, a fixed frame and a chosen frame of its own. ``tick`` and what somebody
    does come from different threads; each has the page to itself.
    """

    def __init__(self, client: Any, subject: Subject) -> None:
        """
        Make the page; ``tick`` draws it.

        :param client: viser's handle of it.
        """
        self._client = client
        self._subject = subject
        self._lock = threading.RLock()
        self._look = Look()
        self._playhead = Playhead(subject.tree, subject.live)
        self._drawn = nothing('')
        self._stirred = True
        self._untold = _TELL_EVERY_S
        self._anchor: tuple[str, Any] | None = None
        self._seen = False
        self._make_controls(client.gui)
        self._scene = Scene(client, subject.shapes,
                            lambda frame: self._ask(lambda: self._choose(frame)))

    def _make_controls(self, gui: Any) -> None:
        self._timeline = Timeline(gui, self._playhead, self._ask)
        tabs = gui.add_tab_group()
        with tabs.add_tab('frames'):
            self._frames = FramesPanel(gui, self._subject.fixed_frame, self._choose, self._ask)
        with tabs.add_tab('chosen'):
            self._chosen = ChosenPanel(gui, self._look.hidden, self._look_at, self._ask)
        with tabs.add_tab('findings'):
            self._findings = FindingsPanel(gui, self._ask)
        with tabs.add_tab('look'):
            self._looks = LookPanel(gui, self._look, self._see_all, self._ask)

    def _ask(self, action: Callable[[], None]) -> None:
        """Do what somebody wants, between two pictures; the next one shows it."""
        with self._lock:
            action()
            self._stirred = True

    # --- drawing

    def tick(self, seconds: float) -> None:
        """
        Draw the page anew, as far as anything on it has changed.

        :param seconds: since the last time.
        """
        with self._lock:
            self._playhead.advance(seconds)
            moment = self._playhead.moment(self._fixed_frame(), self._subject.now())
            self._untold += seconds
            tell = self._stirred or self._untold >= _TELL_EVERY_S
            if tell or not _alike(moment, self._drawn):
                if not self._seen and len(moment.frames) > 1:
                    self._seen = True
                    self._see(moment)
                self._follow(moment)
                self._look.chosen, self._look.found = self._chosen.frame, self._findings.frames
                self._scene.draw(moment, self._look, self._ellipsoid(moment))
            self._drawn = moment
            if tell:
                self._stirred, self._untold = False, 0.0
                self._tell(moment)

    def _ellipsoid(self, moment: Moment) -> Ellipsoid | None:
        """Return where the chosen frame may be, if it is to be seen."""
        frame = self._chosen.frame
        if frame is None or frame in self._look.hidden:
            return None
        return ellipsoid(self._playhead.tree, moment, frame)

    def _fixed_frame(self) -> str:
        chosen = self._frames.fixed_frame
        if chosen is not None:
            return chosen
        # Another root may come, above the one that was there: looked for when words are told.
        if self._stirred or self._untold >= _TELL_EVERY_S or not self._drawn.frames:
            return biggest_root(Queries.edges(self._playhead.tree)) or ''
        return self._drawn.fixed_frame

    def _see(self, moment: Moment) -> None:
        """Choose a size, and a place to look from, with all frames in sight."""
        positions = moment.poses[:, :3]
        middle = (positions.min(axis=0) + positions.max(axis=0)) / 2.0
        reach = max(float(np.linalg.norm(positions - middle, axis=1).max()), 0.1)
        far = np.linalg.norm(middle) > 1_000.0 * reach
        self._look.origin = middle.round() if far else np.zeros(3)
        self._anchor = None
        self._looks.set_length(float(f'{reach * 0.18:.1g}'))
        middle = middle - self._look.origin
        self._client.camera.position = middle + reach * np.array((1.6, -1.85, 1.4))
        self._client.camera.look_at = middle

    def _follow(self, moment: Moment) -> None:
        """Let the followed frame stay where it is on the page."""
        frame = self._chosen.followed
        place = None if frame is None else moment.place(frame)
        if frame is None or place is None:
            self._anchor = None
            return
        position = moment.poses[place, :3]
        key = f'{moment.fixed_frame} {frame}'
        if self._anchor is None or self._anchor[0] != key:
            self._anchor = key, position - self._look.origin
        self._look.origin = position - self._anchor[1]

    def _tell(self, moment: Moment) -> None:
        tree, chosen = self._playhead.tree, self._chosen.frame
        edges = self._edges()
        stale = [moment.frames[place] for place in np.flatnonzero(moment.stale)]
        self._timeline.refresh(moment, chosen, self._remark(moment))
        self._frames.refresh(edges, moment.fixed_frame, stale, self._look.hidden, chosen)
        if chosen is not None:
            self._chosen.refresh(facts(tree, edges, moment, chosen))
        self._findings.refresh(self._subject.findings())
        self._draw_trail(moment)

    def _edges(self) -> list[Any]:
        """Return the edges, with the names of who publishes where those are known."""
        return self._playhead.tree.edges()

    def _remark(self, moment: Moment) -> str:
        """Return why there is nothing to see."""
        if moment.fixed_frame and self._playhead.tree.frames():
            return f'{moment.fixed_frame!r} is no frame of this tree: choose another fixed frame'
        return 'waiting for transforms: does anybody publish on /tf or /tf_static?'

    def _draw_trail(self, moment: Moment) -> None:
        frame = self._chosen.trail
        oldest, latest = self._playhead.window()
        self._scene.draw_trail(
            np.empty((0, 2, 3)) if frame is None else
            trail(self._playhead.tree, moment.fixed_frame, frame, oldest, latest), self._look)

    # --- what somebody does

    def _choose(self, frame: str) -> None:
        self._chosen.choose(frame)

    def _see_all(self) -> None:
        self._seen = False

    def _look_at(self) -> None:
        frame = self._chosen.frame
        place = None if frame is None else self._drawn.place(frame)
        if place is not None:
            self._client.camera.look_at = self._drawn.poses[place, :3] - self._look.origin


def _alike(moment: Moment, drawn: Moment) -> bool:
    """Return whether two moments look the same, but for the shade of what is stale."""
    return (moment.frames == drawn.frames
            and all(np.array_equal(ours, theirs) for ours, theirs in (
                (moment.poses, drawn.poses), (moment.parents, drawn.parents),
                (moment.stale, drawn.stale), (moment.static, drawn.static))))
