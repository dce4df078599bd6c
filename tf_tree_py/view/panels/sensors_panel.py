# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The controls of sensors and of measurements, and those that save what a page shows.

The stamps of the sensors' transforms are selected, too. The chosen frame is measured from another
one, and their relative motion is plotted. A page is saved as a file: one picture, or a film.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from tf_tree_py.core import TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST

from . import markup
from .control_events import Apply, GuiApi, when_changed
from ..model.facts import measured, relative_motion, RelativeMotion
from ..model.moment import Moment
from ..model.playhead import Playhead
from ..sensors.readings import Sensors

_NONE: Final = 'no topic with scans, clouds, paths, poses, odometry, detections or images'


class SensorsPanel:
    """The controls of the sensor topics on one page."""

    def __init__(self, gui: GuiApi, sensors: Sensors, apply: Apply) -> None:
        """Make the controls."""
        self._gui, self._sensors, self._apply = gui, sensors, apply
        self._note = gui.add_html(markup.note(_NONE))
        self._newest = gui.add_checkbox(
            'at the newest transform', False, hint='Instead of the one at the stamp of each '
            'message: the mistake that smears a scan while the robot turns.')
        self._folder = gui.add_folder('topics')
        self._boxes: dict[str, Any] = {}
        self._image: Any = None
        when_changed(self._newest, apply)

    @property
    def at_newest(self) -> bool:
        """Return whether to use the newest transform instead of the one at the stamp."""
        return bool(self._newest.value)

    def wanted(self) -> list[str]:
        """Return the topics that are switched on."""
        return [topic for topic, box in self._boxes.items() if box.value]

    def refresh(self, missing: Sequence[str]) -> None:
        """
        List the topics that exist now.

        :param missing: what cannot be shown, one sentence each.
        """
        with self._folder:
            for topic in self._sensors.topics():
                if topic not in self._boxes:
                    self._boxes[topic] = box = self._gui.add_checkbox(topic, False)
                    when_changed(box, self._apply, partial(self._switch, topic))
        self._note.content = (markup.warnings(missing) if missing else '') if self._boxes else (
            markup.note(_NONE))

    def show_image(self, image: npt.NDArray[np.uint8] | None) -> None:
        """Show the image of a camera; None: no image."""
        if image is None:
            if self._image is not None:
                self._image.visible = False
        elif self._image is None:
            self._image = self._gui.add_image(image, order=0.5)
        else:
            self._image.visible, self._image.image = True, image

    def close(self) -> None:
        """Release all topics."""
        for topic in self.wanted():
            self._sensors.release(topic, self)

    def _switch(self, topic: str) -> None:
        if self._boxes[topic].value:
            self._sensors.want(topic, self)
        else:
            self._sensors.release(topic, self)


# --- saving

_RECORD: Final = 'record a GIF'


class PicturesPanel:
    """The buttons for a picture and a film on one page."""

    def __init__(self, gui: GuiApi, save_picture: Callable[[], None],
                 record: Callable[[float], None], apply: Apply) -> None:
        """
        Make the controls.

        :param record: records a film of so many seconds, or ends the one that is recorded.
        """
        gui.add_button('save this picture').on_click(lambda _: apply(save_picture))
        self._seconds = gui.add_number(
            'length [s]', 5.0, min=0.1, max=600.0, step=0.5,
            hint='Recorded seconds of the GIF, from the moment that the page shows. The speed is '
            'that of the timeline.')
        self._record = gui.add_button(_RECORD)
        self._record.on_click(lambda _: apply(lambda: record(float(self._seconds.value))))

    def refresh(self, progress: tuple[int, int] | None) -> None:
        """
        Show how far a film is.

        :param progress: the pictures that exist and those that are needed; None: no film.
        """
        self._record.label = _RECORD if progress is None else 'stop ({} of {})'.format(*progress)


# --- measurements

_FIXED: Final = '(the fixed frame)'
_COLOURS: Final = ('#e03131', '#2f9e44', '#1c7ed6')
_NOW: Final = '#d6336c'
_HEIGHT: Final = 170


class MotionPanel:
    """The relative motion of two frames on one page."""

    def __init__(self, gui: GuiApi, apply: Apply) -> None:
        """Make the controls."""
        self._gui = gui
        self._other = gui.add_dropdown('measure from', (_FIXED,), hint='The pose of the chosen '
                                       'frame in this one, now and over the window.')
        self._facts = gui.add_html('')
        self._plot = gui.add_checkbox('plot', False, hint='x, y, z and roll, pitch, yaw over the '
                                      'window. The step marks the moment that the page shows.')
        self._charts: tuple[Any, ...] = ()
        self._known: tuple[object, RelativeMotion | None] = None, None
        when_changed(self._other, apply)
        when_changed(self._plot, apply)

    @property
    def other(self) -> str | None:
        """Return the frame from which the page measures; None: the fixed frame."""
        return None if self._other.value == _FIXED else self._other.value

    def refresh(self, playhead: Playhead, moment: Moment, chosen: str | None) -> None:
        """Show the relative pose of the frames now, and its range over the window."""
        frames = {*playhead.tree.frames(), self.other or _FIXED} - {_FIXED}
        options = (_FIXED, *sorted(frames))
        if self._other.options != options:
            self._other.options = options
        if chosen is None or not moment.frames:
            self._facts.content = ''
            self._draw(None, 0, 0)
            return
        target = self.other or moment.fixed_frame
        oldest, latest = playhead.window()
        wanted = self.other is not None or self._plot.value
        motion = self._motion(playhead, target, chosen, oldest, latest) if wanted else None
        try:
            now = playhead.tree.lookup(target, chosen, moment.stamp or LATEST)
        except TransformException:
            now = None
        self._facts.content = markup.table(
            [('measured', f'{chosen} in {target}'), *measured(now, motion)]
        ) if self.other is not None else ''
        self._draw(motion if self._plot.value else None, oldest, moment.stamp)

    def _motion(self, playhead: Playhead, target: str, chosen: str, oldest: int,
                latest: int) -> RelativeMotion | None:
        key = playhead.tree, target, chosen, oldest, latest
        if self._known[0] != key:
            self._known = key, relative_motion(playhead.tree, target, chosen, oldest, latest)
        return self._known[1]

    def _draw(self, motion: RelativeMotion | None, oldest: int, stamp: int) -> None:
        if motion is None or not len(motion.stamps):
            for chart in self._charts:
                chart.visible = False
            return
        seconds = (motion.stamps - oldest) / 1e9
        datas = [_data(seconds, values, (stamp - oldest) / 1e9)
                 for values in (motion.positions, motion.angles)]
        if not self._charts:
            self._charts = tuple(
                self._chart(data, names, unit) for data, names, unit in zip(
                    datas, (('x', 'y', 'z'), ('roll', 'pitch', 'yaw')), ('m', 'deg'), strict=True))
            return
        for chart, data in zip(self._charts, datas, strict=True):
            chart.visible = True
            chart.data = data

    def _chart(self, data: tuple[Array, ...], names: tuple[str, ...], unit: str) -> Any:
        import viser.uplot
        series = [viser.uplot.Series(label='s')]
        series += [viser.uplot.Series(label=f'{name} [{unit}]', stroke=colour, width=1.5)
                   for name, colour in zip(names, _COLOURS, strict=True)]
        series.append(viser.uplot.Series(label='now', stroke=_NOW, width=1))
        return self._gui.add_uplot(
            data, tuple(series), height=_HEIGHT,
            scales={'x': viser.uplot.Scale(time=False)})


def _data(seconds: Array, values: Array, now: float) -> tuple[Array, ...]:
    """Return the columns of a chart: times, three values, and a step at the present moment."""
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    step = np.where(seconds < now, low, high)
    return (seconds, *values.T, step)
