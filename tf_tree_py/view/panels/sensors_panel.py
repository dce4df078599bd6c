# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The controls that select sensor topics, and those that save what a page shows.

The stamps of the sensors' transforms are selected, too. A page is saved as a file: one picture,
or a film.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from . import markup
from .control_events import Apply, GuiApi, when_changed
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
