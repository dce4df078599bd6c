# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Fits the view of a page to the robot: the camera, the origin, and the sizes of axes.

The extent of a robot is that of its frames and of the corners of its links. The camera of a page
is read and moved here, also if a person has moved it.
"""

from collections.abc import Callable, Sequence
from typing import Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry.so3 import Array

from ..framing.camera import axes_length, Camera, cell_of, DIRECTION, of_the_robot
from ..model.moment import Moment
from ..panels.appearance_panel import AppearancePanel
from ..robot.shapes import LinkShape
from ..scene.scene import Appearance

if TYPE_CHECKING:
    from viser import ClientHandle


def _corners_of(shapes: Sequence[LinkShape]) -> dict[str, Array]:
    """Return the corners of the box around each link's shapes, (8, 3) in its frame."""
    spans: dict[str, tuple[Array, Array]] = {}
    for shape in shapes:
        if not len(shape.vertices):
            continue
        low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        least, most = spans.get(shape.link, (low, high))
        spans[shape.link] = np.minimum(low, least), np.maximum(high, most)
    unit = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    return {link: low + unit * (high - low) for link, (low, high) in spans.items()}


def extent(moment: Moment, shown: npt.NDArray[np.bool_], corners: dict[str, Array]) -> Array:
    """
    Return points whose convex hull contains some frames and their links.

    :param shown: (N,) whether each frame counts.
    :param corners: the corners of each link, (8, 3) in its frame, by frame.
    :return: (M, 3) in the fixed frame, metres.
    """
    points = [moment.poses[shown, :3]]
    for place in np.flatnonzero(shown).tolist():
        box = corners.get(moment.frames[place])
        if box is not None:
            points.append(np.asarray(Pose(*moment.poses[place].tolist()) @ box))
    return np.concatenate(points)


# --- the camera of a page

# The assumed height of the picture until the browser reports it, CSS pixels.
_HEIGHT: Final = 800.0


class CameraControl:
    """The camera of one page, in the page's axes."""

    def __init__(self, client: 'ClientHandle', size: Callable[[], tuple[float, float] | None],
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
        width, height = self._size() or (
            _HEIGHT * handle.image_width / (handle.image_height or 1), _HEIGHT)
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


# --- fitting

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
            self._shapes, self._corners = shapes, _corners_of(shapes)
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
