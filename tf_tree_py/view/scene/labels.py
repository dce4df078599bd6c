# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The names of the frames beside their axes, without overlaps."""

from collections.abc import Sequence
from typing import Any, Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.text import shorten

from ..framing.camera import Camera
from ..framing.label_layout import layout

if TYPE_CHECKING:
    from viser import SceneApi

# Each name that moves costs a message. A picture moves at most so many; the others follow in turn.
_AT_ONCE: Final = 40
_LONGEST_NAME: Final = 60
_ALL: Final = 400
# The setting "few" shows one name for so many square pixels.
_AREA_OF_A_NAME: Final = 32_000.0


class _Name:
    """One name on the page, and its state in the browser."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.position: tuple[float, ...] = ()
        self.side = ''
        self.visible = True

    def put(self, position: tuple[float, ...], side: str) -> bool:
        """Show the name at a position; return whether anything had to be sent."""
        changed = not self.visible or self.side != side or self.position != position
        if not self.visible:
            self.node.visible = self.visible = True
        if self.side != side:
            self.node.anchor = self.side = side
        if self.position != position:
            self.node.position = self.position = position
        return changed

    def hide(self) -> None:
        """Hide the name."""
        if self.visible:
            self.node.visible = self.visible = False


class Labels:
    """
    The names on one page.

    Each name is a node of viser, which has no node for many names. A picture moves at most 40
    of them. Up to 40 names therefore follow their frames at once, and more with a small delay.
    """

    def __init__(self, scene: 'SceneApi') -> None:
        self._scene = scene
        self._root = scene.add_frame('/names', show_axes=False)
        self._names: dict[str, _Name] = {}
        self._numbers = 0
        self._next = 0

    def draw(self, frames: Sequence[str], positions: Array, shown: npt.NDArray[np.bool_],
             camera: Camera | None, first: Sequence[str], amount: str) -> None:
        """
        Show the names of some frames.

        :param positions: (N, 3) of all of them, metres.
        :param shown: (N,) which of them may be shown.
        :param camera: of the page; None: not known yet, so no name is shown.
        :param first: the frames whose names are placed before all others.
        :param amount: 'none', 'few', or 'all' for all names that fit.
        """
        for frame in [frame for frame in self._names if frame not in frames]:
            self._names.pop(frame).node.remove()
        wanted = [] if camera is None else [
            frame for frame, show in zip(frames, shown.tolist(), strict=True) if show]
        sides = self._sides(wanted, positions[shown], camera, first, amount)
        for frame, name in self._names.items():
            if frame not in sides:
                name.hide()
        places = dict(zip(frames, positions.tolist(), strict=True))
        seen = list(sides)
        moved = 0
        for turn in range(len(seen)):
            frame = seen[(self._next + turn) % len(seen)]
            moved += self._name(frame).put(tuple(places[frame]), sides[frame])
            if moved >= _AT_ONCE:
                self._next = (self._next + turn + 1) % len(seen)
                return

    def _sides(self, names: Sequence[str], positions: Array, camera: Camera | None,
               first: Sequence[str], amount: str) -> dict[str, str]:
        """Return the side of its frame for each name to show, by frame."""
        if camera is None or not names or amount == 'none':
            return {}
        most = _ALL if amount == 'all' else int(camera.width * camera.height / _AREA_OF_A_NAME)
        order = {name: place for place, name in enumerate(names)}
        before = {order[frame]: name.side for frame, name in self._names.items()
                  if name.visible and frame in order}
        texts = [shorten(name, _LONGEST_NAME) for name in names]
        found = layout(camera, texts, positions, [order[name] for name in first if name in order],
                       before, most)
        return {names[place]: side for place, side in found.items()}

    def _name(self, frame: str) -> _Name:
        if frame not in self._names:
            # Names of frames may contain slashes, so nodes have numbers.
            self._numbers += 1
            self._names[frame] = _Name(self._scene.add_label(
                f'/names/{self._numbers}', shorten(frame, _LONGEST_NAME)))
        return self._names[frame]
