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

"""The controls of the frames: the fixed one, a search, and the list as a tree."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from tf_tree_py.core import EdgeInfo

from . import markup
from .asking import Ask, nothing_else, when_changed
from ..shown.listing import MOST_ROWS, Row, rows

_NONE: Final = '(none yet)'


class FramesPanel:
    """
    The list of frames of one page.

    :ivar fixed_frame: what somebody chose; None: nobody has.
    """

    def __init__(self, gui: Any, fixed_frame: str | None, on_choice: Callable[[str], None],
                 ask: Ask) -> None:
        """
        Make the controls.

        :param on_choice: is called with the frame that somebody clicked in the list.
        :param ask: lets something be done between two pictures.
        """
        self.fixed_frame = fixed_frame
        self._rows: dict[str, Row] = {}
        self._on_choice = on_choice
        self._fixed = gui.add_dropdown('fixed frame', (fixed_frame or _NONE,),
                                       hint='Everything is drawn as this frame sees it.')
        self._search = gui.add_text('search', '')
        self._style = gui.add_html(markup.style_of_list((), (), (), None))
        self._list = gui.add_button_group('', (_NONE,), visible=False)
        self._more = gui.add_html('')
        when_changed(self._fixed, ask, self._fix)
        when_changed(self._search, ask, nothing_else)
        self._list.on_click(lambda event: ask(lambda: self._pressed(event.target.value)))

    def refresh(self, edges: Sequence[EdgeInfo], fixed_frame: str, stale: Iterable[str],
                hidden: Iterable[str], chosen: str | None) -> None:
        """Show the frames that there are; what is the same already costs nothing."""
        self._refresh_fixed(edges, fixed_frame)
        found = rows(edges, self._search.value)
        shown = found[:MOST_ROWS]
        self._rows = {markup.text_of(row): row for row in shown}
        self._list.visible = bool(shown)
        if shown and self._list.options != tuple(self._rows):
            self._list.options = tuple(self._rows)
        self._style.content = markup.style_of_list(shown, stale, hidden, chosen)
        more = len(found) - len(shown)
        self._more.content = markup.note(
            f'and {more} more: a search finds them' if more else
            '● moves, ○ is static; grey is stale' if found else 'no frame')

    def _refresh_fixed(self, edges: Sequence[EdgeInfo], fixed_frame: str) -> None:
        frames = sorted({name for edge in edges for name in (edge.parent, edge.child)}
                        | ({fixed_frame} if fixed_frame else set())) or [_NONE]
        if self._fixed.options != tuple(frames):
            # Another value would be chosen for us where the present one is no option.
            self._fixed.options = (*frames, *({self._fixed.value} - {*frames}))
        self._fixed.value = fixed_frame or _NONE
        if self._fixed.options != tuple(frames):
            self._fixed.options = tuple(frames)

    def _fix(self) -> None:
        if self._fixed.value != _NONE:
            self.fixed_frame = self._fixed.value

    def _pressed(self, text: str) -> None:
        if text in self._rows:
            self._on_choice(self._rows[text].frame)
