# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the selected sensor topics show on one page at a moment."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core.geometry.so3 import Array

from ..model.moment import Moment
from ..panels.sensors_panel import SensorsPanel
from ..scene.sensor_points import Seen
from ..sensors.images import Pixels
from ..sensors.placing import placed
from ..sensors.readings import Reading
from ..sensors.sensor_source import SensorSource

# The number of messages that make up a trail, such as that of an odometry.
_TRAIL: Final = 300


class SensorView:
    """
    Turns readings into points in the fixed frame and a picture.

    :ivar missing: what cannot be shown at the moment, one sentence each.
    """

    def __init__(self, source: SensorSource | None, panel: SensorsPanel) -> None:
        self._source, self._panel = source, panel
        self.missing: list[str] = []
        self._image: Pixels | None = None

    def seen(self, tree: AllQueries, moment: Moment) -> dict[str, Seen]:
        """Return what each topic shows at a moment, by topic; show the picture of a camera."""
        self.missing, self._image = [], None
        wanted = self._panel.wanted() if self._source is not None else []
        seen = {topic: found for topic in wanted
                if (found := self._of_topic(tree, moment, topic)) is not None}
        self._panel.show_image(self._image)
        return seen

    def _of_topic(self, tree: AllQueries, moment: Moment, topic: str) -> Seen | None:
        assert self._source is not None
        reading = self._source.reading(topic, moment.stamp)
        if reading is None or reading.problem:
            problem = 'no message at or before this stamp' if reading is None else reading.problem
            self.missing.append(f'{topic}: {problem}')
            return None
        if reading.image is not None:
            self._image = reading.image
            return None
        if reading.is_line and len(reading.points) == 1:
            return self._trail(tree, moment, self._source.trail(topic, moment.stamp, _TRAIL))
        points = placed(tree, moment.fixed_frame, reading, self._panel.at_newest)
        if points is None:
            self.missing.append(f'{topic}: no transform from {reading.frame!r} at its stamp')
            return None
        return Seen(points, reading.is_line)

    def _trail(self, tree: AllQueries, moment: Moment, readings: Sequence[Reading]) -> Seen | None:
        """Return the positions of several messages, each at its own stamp, as one line."""
        newest = self._panel.at_newest
        placed_points = [placed(tree, moment.fixed_frame, reading, newest)
                         for reading in readings]
        found: list[Array] = [points for points in placed_points if points is not None]
        return Seen(np.concatenate(found), True) if found else None
