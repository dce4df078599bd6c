# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The controls of time: a slider over the window, and the buttons play, pause, step and live."""

from collections.abc import Sequence
from typing import Final

from tf_tree_py.core.stamp import format_stamp
from viser._messages import GuiSliderMark

from . import markup
from .control_events import Apply, GuiApi, Shared, when_changed
from ..model.moment import Moment
from ..model.playhead import Playhead

_BACK, _FORTH = '◀ step', 'step ▶'
_PLAY, _PAUSE, _LIVE = 'play', 'pause', 'live'
_SPEEDS: Final = ('0.1', '0.25', '0.5', '1', '2', '5', '10')
_STEP_S: Final = 0.001


class Timeline:
    """The controls that select the moment of one page."""

    def __init__(self, gui: GuiApi, playhead: Playhead, tree_name: str, apply: Apply) -> None:
        """
        Make the controls.

        :param playhead: the moment that the controls change.
        :param tree_name: of the tree's input.
        :param apply: calls an action between two pictures.
        """
        self._playhead = playhead
        self._chosen: str | None = None
        self._tree_name = tree_name
        self._status = gui.add_html(markup.status(tree_name, 'waiting for transforms'))
        self._slider = gui.add_slider(
            'time [s]', min=0.0, max=1.0, step=_STEP_S, initial_value=0.0,
            hint='Seconds since the oldest sample in memory. Moving the slider pauses. Marks '
            'show samples that were refused or odd.')
        self._position_s = Shared(self._slider, apply, self._moved)
        gui.add_html(markup.bare())
        self._buttons = gui.add_button_group('', self._names())
        self._speed = gui.add_dropdown('speed', _SPEEDS, initial_value='1')
        self._buttons.on_click(lambda event: apply(lambda: self._pressed(event.target.value)))
        when_changed(self._speed, apply, self._sped)

    def refresh(self, moment: Moment, chosen: str | None, remark: str, age_s: float | None,
                incidents: Sequence[int]) -> None:
        """
        Show the moment of the page; only changes are sent to the browser.

        :param chosen: the frame whose samples the step buttons visit; None: any frame.
        :param remark: why the page is empty, if the moment has no frames.
        :param age_s: the age of a live picture, seconds; None: the page is not live.
        :param incidents: the stamps to mark on the slider, nanoseconds.
        """
        playhead = self._playhead
        self._chosen = chosen
        oldest, newest = playhead.window()
        self._slider.max = max((newest - oldest) / 1e9, _STEP_S)
        self._position_s.show(min(max((playhead.stamp - oldest) / 1e9, 0.0), self._slider.max))
        if self._buttons.options != self._names():
            self._buttons.options = self._names()
        self._mark([(stamp - oldest) / 1e9 for stamp in incidents if oldest <= stamp <= newest])
        self._status.content = markup.status(self._tree_name, self._state(moment, remark, age_s))

    def _mark(self, seconds: Sequence[float]) -> None:
        marks = tuple(GuiSliderMark(value=at, label=None) for at in seconds)
        if self._slider._marks != marks:
            self._slider._marks = marks  # viser has no public way to change them later

    def _state(self, moment: Moment, remark: str, age_s: float | None) -> str:
        if not moment.frames:
            return remark
        playhead = self._playhead
        state = 'live' if playhead.live and moment.stamp else 'at rest' if playhead.live else (
            f'playing, {playhead.speed:g} times' if playhead.playing else 'paused')
        stamp = f' at {format_stamp(moment.stamp)} s' if moment.stamp else ''
        age = f', {age_s:.1f} s old' if age_s is not None and moment.stamp else ''
        stale = int(moment.stale.sum())
        count = len(moment.frames)
        return (f'{state}{stamp}{age}: {count} frame{"s" if count != 1 else ""}'
                f'{f", {stale} stale" if stale else ""}')

    def _names(self) -> tuple[str, ...]:
        middle = _PAUSE if self._playhead.live or self._playhead.playing else _PLAY
        return (_BACK, middle, _FORTH, *([_LIVE] if self._playhead.has_live else []))

    # --- events

    def _moved(self, position_s: float) -> None:
        self._playhead.pause()
        oldest, _ = self._playhead.window()
        self._playhead.seek(oldest + round(position_s * 1e9))

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
