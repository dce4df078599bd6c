# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fits the view of a page to the robot: the camera, the origin, and the sizes of axes."""

from collections.abc import Sequence

import numpy as np
from tf_tree_py.core.geometry.so3 import Array

from .camera_control import CameraControl
from ..framing.sizes import axes_length, cell_of, of_the_robot
from ..model.moment import Moment
from ..panels.appearance_panel import AppearancePanel
from ..robot.extent import corners_of, extent
from ..robot.shapes import LinkShape
from ..scene.scene import Appearance

# A camera that no person has moved is fitted again when the frames become so many times as many.
_MORE = 1.2
_LEAST_REACH = 0.1
# A robot that is so many times its size away from the origin is moved to it, because the browser
# uses single precision.
_FAR = 1_000.0


class Framing:
    """Keeps the robot in view until a person moves the camera."""

    def __init__(self, camera: CameraControl, look: Appearance, panel: AppearancePanel) -> None:
        """
        Begin without a view.

        :param camera: of the page.
        :param look: its origin and sizes are set here.
        :param panel: shows the sizes.
        """
        self._camera = camera
        self._look = look
        self._panel = panel
        # The fixed frame, and the numbers of frames and shapes, at the last fit.
        self._seen: tuple[str, int, int] | None = None
        self._resized = False
        self._wanted: Array | None = None
        self._shapes: Sequence[LinkShape] | None = None
        self._corners: dict[str, Array] = {}
        # The fixed frame, the followed frame, and the position that it keeps on the page.
        self._held: tuple[tuple[str, str], Array] | None = None

    def see_new(self, moment: Moment, shapes: Sequence[LinkShape]) -> None:
        """Fit the view to a robot that is new or has grown, unless a person moved the camera."""
        if len(moment.frames) < 2 and not shapes:
            return
        count, links = len(moment.frames), len(shapes)
        seen = self._seen
        same_frame = seen is not None and seen[0] == moment.fixed_frame
        has_grown = seen is None or count > _MORE * seen[1] or links > seen[2]
        if same_frame and not has_grown and not self._resized:
            return
        if self._camera.camera() is None or (same_frame and not self._camera.is_untouched):
            return
        self.see(moment, shapes, everything=False)

    def see_again(self) -> None:
        """Fit the view to a window of another size, unless a person has moved the camera."""
        # Later: a report of the camera from before the last fit may still be on its way, and
        # then the camera seems to have been moved.
        self._resized = True

    def stand(self, camera: Array) -> None:
        """
        Move the camera to the view of a link as soon as there are frames.

        :param camera: (2, 3) its position and the point at which it looks, in the fixed frame,
            metres.
        """
        self._wanted, self._seen = camera, None

    def see(self, moment: Moment, shapes: Sequence[LinkShape], everything: bool) -> None:
        """Turn the camera to all frames, or only to those of the robot, and choose the sizes."""
        if not moment.frames:
            return
        if shapes is not self._shapes:
            self._shapes, self._corners = shapes, corners_of(shapes)
        positions = moment.poses[:, :3]
        shown = (np.ones(len(positions), np.bool_) if everything else of_the_robot(positions))
        points = extent(moment, shown, self._corners)
        reach = max(float(np.ptp(points, axis=0).max()) / 2.0, _LEAST_REACH)
        middle = points.mean(axis=0)
        far = np.linalg.norm(middle) > _FAR * reach
        self._look.origin = middle.round() if far else np.zeros(3)
        self._held = None
        self._panel.set_sizes(axes_length(moment), cell_of(reach))
        if self._wanted is not None:
            self._camera.put(*(self._wanted - self._look.origin), ours=False)
        else:
            self._camera.fit(points - self._look.origin, reach, afresh=self._seen is None)
        self._wanted, self._resized = None, False
        self._seen = moment.fixed_frame, len(moment.frames), len(shapes)

    def hold(self, moment: Moment, frame: str | None) -> None:
        """Keep a followed frame at its position on the page; None: no frame is followed."""
        place = None if frame is None else moment.place(frame)
        if frame is None or place is None:
            self._held = None
            return
        position = moment.poses[place, :3]
        key = moment.fixed_frame, frame
        if self._held is None or self._held[0] != key:
            self._held = key, position - self._look.origin
        self._look.origin = position - self._held[1]
