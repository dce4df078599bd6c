# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The camera of a page: reads it, moves it, and reports whether a person has moved it."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from tf_tree_py.core.geometry.so3 import Array

from ..framing.camera import Camera, DIRECTION

# The assumed height of the picture until the browser reports it, CSS pixels.
_HEIGHT: Final = 800.0


class CameraControl:
    """The camera of one page, in the page's axes."""

    def __init__(self, client: Any, size: Callable[[], tuple[float, float] | None],
                 moved: Callable[[], None]) -> None:
        """
        Watch the camera.

        :param client: viser's handle of the page.
        :param size: returns the width and height of the picture, CSS pixels; None: not known.
        :param moved: is called when the camera has moved.
        """
        self._handle = client.camera
        self._size = size
        # The position and target that the program chose last.
        self._put: Array | None = None
        self._wanted = False
        self._handle.on_update(lambda _: moved())

    def camera(self) -> Camera | None:
        """Return the camera; None until the browser reports it."""
        handle = self._handle
        if handle._state.update_timestamp == 0.0 or not handle.fov:
            return None
        height = handle.image_height or 1
        width, height = self._size() or (_HEIGHT * handle.image_width / height, _HEIGHT)
        return Camera(np.array(handle.position), np.array(handle.look_at), float(handle.fov),
                      width, height)

    @property
    def is_untouched(self) -> bool:
        """Return whether the camera is where the program put it."""
        camera = self.camera()
        if camera is None or self._put is None:
            return not self._wanted
        now = np.array((camera.position, camera.look_at))
        reach = float(np.linalg.norm(self._put[0] - self._put[1]))
        return bool(np.abs(now - self._put).max() < 0.01 * reach)

    def put(self, position: Array, look_at: Array, *, ours: bool = True) -> None:
        """
        Move the camera.

        :param ours: whether the program chose this view and may replace it by another.
        """
        self._handle.position = position
        self._handle.look_at = look_at
        self._put = np.array((position, look_at)) if ours else None
        self._wanted = not ours

    def fit(self, points: Array, least: float, *, afresh: bool) -> None:
        """
        Move the camera so that it sees all of some points.

        :param points: (N, 3) metres.
        :param least: the radius that must be visible around each point, metres.
        :param afresh: whether to look from the default direction instead of the present one.
        """
        camera = self.camera()
        if camera is not None:
            fitted = camera.fitted(points, least, DIRECTION if afresh else None)
            self.put(fitted.position, fitted.look_at)

    def look_at(self, point: Array) -> None:
        """Turn the camera to a point."""
        self._handle.look_at = point
