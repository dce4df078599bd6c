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

"""The names of the frames, beside their axes."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.text import shorten

# A name is a message of its own whenever it moves. So many go at once; of more, each in its turn.
_AT_ONCE: Final = 40
_LONGEST_NAME: Final = 60


class Labels:
    """
    The names on one page; a node each, for viser has none for many.

    Only those that moved are sent, and not more at once than the budget. So a few follow
    their frames in every picture, and hundreds a little later.
    """

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._root = scene.add_frame('/names', show_axes=False)
        # Of each frame the node, and where it is.
        self._nodes: dict[str, tuple[Any, tuple[float, ...]]] = {}
        self._numbers = 0
        self._next = 0

    def draw(self, frames: Sequence[str], positions: Array, shown: npt.NDArray[np.bool_]) -> None:
        """
        Show the names of some frames.

        :param positions: (N, 3) of all of them, metres.
        :param shown: (N,) which of them to show.
        """
        wanted = {frame: position for frame, position, show
                  in zip(frames, positions.tolist(), shown.tolist(), strict=True) if show}
        for frame in [frame for frame in self._nodes if frame not in wanted]:
            self._nodes.pop(frame)[0].remove()
        names = list(wanted)
        moved = 0
        for turn in range(len(names)):
            frame = names[(self._next + turn) % len(names)]
            moved += self._put(frame, tuple(wanted[frame]))
            if moved >= _AT_ONCE:
                self._next = (self._next + turn + 1) % len(names)
                return

    def _put(self, frame: str, position: tuple[float, ...]) -> bool:
        """Put a name somewhere; return whether that changed anything."""
        node, before = self._nodes.get(frame, (None, ()))
        if position == before:
            return False
        if node is None:
            # Frames may have any name, slashes among them, so nodes have numbers.
            self._numbers += 1
            node = self._scene.add_label(f'/names/{self._numbers}', shorten(frame, _LONGEST_NAME),
                                         position=position)
        else:
            node.position = position
        self._nodes[frame] = node, position
        return True
