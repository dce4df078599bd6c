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

"""Which moment a page shows: the newest, one that was chosen, or one that goes on by itself."""

import numpy as np
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.queries import Queries

from .living import window
from .moment import live_moment, Moment, moment_at

# The stamp 0 would be the newest, not the beginning.
_FIRST = LATEST + 1


class Playhead:
    """
    Where a page is in time.

    A page that does not follow the newest looks at a copy of the buffer, made when it
    stopped: so nothing that it can go to is forgotten meanwhile.

    :ivar tree: what is looked at.
    :ivar live: whether the page follows the newest.
    :ivar playing: whether the moment goes on by itself.
    :ivar speed: of playing; 1 is as it was.
    :ivar stamp: of the moment, nanoseconds; that of a live one when it was last looked at.
    """

    def __init__(self, tree: Queries, live: bool) -> None:
        """
        Begin with the newest moment of a live tree, or with the first of a recording.

        :param live: whether the tree changes.
        """
        self._source = tree
        self.tree = tree
        self.has_live = self.live = live
        self.playing = False
        self.speed = 1.0
        self._stamps: dict[str, Stamps] = {}
        oldest, latest = self.window()
        self.stamp = latest if live else max(oldest, _FIRST)

    def window(self) -> tuple[int, int]:
        """Return the oldest and the newest stamp that it can go to, nanoseconds."""
        return window(Queries.edges(self.tree), self.tree.cache_time)

    def moment(self, fixed_frame: str, now: int) -> Moment:
        """
        Return what there is to see.

        :param now: what the ages of a live moment are counted from, nanoseconds.
        """
        if not self.live:
            return moment_at(self.tree, fixed_frame, self.stamp)
        moment = live_moment(self.tree, fixed_frame, now)
        self.stamp = moment.stamp
        return moment

    # --- going elsewhere

    def go_live(self) -> None:
        """Follow the newest, where there is one."""
        if self.has_live:
            self.tree = self._source
            self.live, self.playing = True, False
            self._stamps.clear()

    def pause(self) -> None:
        """Stay at the moment."""
        self.playing = False
        if self.live:
            self.live = False
            self.tree = self._source.snapshot()

    def play(self) -> None:
        """Go on from the moment; from the beginning, if it is the last one."""
        self.pause()
        oldest, latest = self.window()
        if self.stamp >= latest:
            self.seek(oldest)
        self.playing = True

    def seek(self, stamp: int) -> None:
        """Go to a stamp, or to the nearest end of the window."""
        self.pause()
        oldest, latest = self.window()
        self.stamp = max(min(max(stamp, oldest), latest), _FIRST)

    def step(self, frame: str | None, count: int) -> None:
        """
        Go to another sample.

        :param frame: whose samples; None: those of all frames.
        :param count: how many further; negative: back.
        """
        self.pause()
        stamps = self._samples(frame)
        if not len(stamps):
            return
        first = stamps.searchsorted(self.stamp, 'right' if count > 0 else 'left')
        place = int(first) + count - (count > 0)
        self.seek(int(stamps[min(max(place, 0), len(stamps) - 1)]))

    def _samples(self, frame: str | None) -> Stamps:
        key = frame or ''
        if key not in self._stamps:
            frames = self.tree.frames() if frame is None else [frame]
            self._stamps[key] = np.unique(np.concatenate(
                [np.empty(0, np.int64), *(self.tree.stamps_of(each) for each in frames)]))
        return self._stamps[key]

    def advance(self, seconds: float) -> None:
        """Let so much time pass, which moves a page that plays."""
        if not self.playing:
            return
        latest = self.window()[1]
        self.stamp = min(self.stamp + round(seconds * self.speed * 1e9), latest)
        self.playing = self.stamp < latest
