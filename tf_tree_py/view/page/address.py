# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The address of a page, which contains the moment, the frames and the camera."""

import numpy as np
from tf_tree_py.core.geometry.so3 import Array

from .camera_control import CameraControl
from .controls import Controls
from ..model.moment import Moment
from ..model.playhead import Playhead
from ..model.view_link import ViewLink
from ..scene.scene import Appearance


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
