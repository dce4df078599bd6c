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

"""The controls of time: a slider over the window, play, pause, steps and live."""

from typing import Any, Final

from tf_tree_py.core.stamp import format_stamp

from . import markup
from .asking import Ask, when_changed
from ..shown.moment import Moment
from ..shown.playhead import Playhead

_BACK, _FORTH = '◀ step', 'step ▶'
_PLAY, _PAUSE, _LIVE = 'play', 'pause', 'live'
_SPEEDS: Final = ('0.1', '0.25', '0.5', '1', '2', '5', '10')


class Timeline:
    """Where a page is in time, and what changes that."""

    def __init__(self, gui: Any, playhead: Playhead, ask: Ask) -> None:
        """
        Make the controls.

        :param ask: lets something be done between two pictures.
        """
        self._playhead = playhead
        self._chosen: str | None = None
        self._status = gui.add_html(markup.status('waiting for transforms'))
        self._slider = gui.add_slider(
            'time [s]', min=0.0, max=1.0, step=0.001, initial_value=0.0,
            hint='Seconds since the oldest sample that is kept; moving it pauses.')
        self._set = self._slider.value
        gui.add_html(markup.bare())
        self._buttons = gui.add_button_group('', self._names())
        self._speed = gui.add_dropdown('speed', _SPEEDS, initial_value='1')
        when_changed(self._slider, ask, self._moved)
        self._buttons.on_click(lambda event: ask(lambda: self._pressed(event.target.value)))
        when_changed(self._speed, ask, self._sped)

    def refresh(self, moment: Moment, chosen: str | None, remark: str) -> None:
        """Show where the page is; what is the same already costs nothing."""
        playhead = self._playhead
        self._chosen = chosen
        oldest, latest = playhead.window()
        self._slider.max = max((latest - oldest) / 1e9, 0.001)
        # Where it stands elsewhere by now, somebody has just moved it: that is yet to be done.
        if self._slider.value == self._set:
            # This calls whoever hears of the slider, without a client: then nobody has moved it.
            self._slider.value = min(max((playhead.stamp - oldest) / 1e9, 0.0), self._slider.max)
            self._set = self._slider.value
        if self._buttons.options != self._names():
            self._buttons.options = self._names()
        self._status.content = markup.status(self._told(moment, remark))

    def _told(self, moment: Moment, remark: str) -> str:
        if not moment.frames:
            return remark
        state = 'live' if self._playhead.live else (
            f'playing, {self._playhead.speed:g} times' if self._playhead.playing else 'paused')
        stamp = f' at {format_stamp(moment.stamp)} s' if moment.stamp else ''
        stale = int(moment.stale.sum())
        return (f'{state}{stamp}: {len(moment.frames)} frames'
                f'{f", {stale} stale" if stale else ""}')

    def _names(self) -> tuple[str, ...]:
        middle = _PAUSE if self._playhead.live or self._playhead.playing else _PLAY
        return (_BACK, middle, _FORTH, *([_LIVE] if self._playhead.has_live else []))

    # --- what somebody does

    def _moved(self) -> None:
        self._set = self._slider.value
        self._playhead.pause()
        oldest, _ = self._playhead.window()
        self._playhead.seek(oldest + round(self._set * 1e9))

    def _sped(self) -> None:
        self._playhead.speed = float(self._speed.value)

    def _pressed(self, name: str) -> None:
        playhead = self._playhead
        if name == _PLAY:
            playhead.play()
        elif name == _PAUSE:
            playhead.pause()
        elif name == _LIVE:
            playhead.go_live()
        else:
            playhead.step(self._chosen, 1 if name == _FORTH else -1)
