# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The controls of the frames: the fixed frame, a search, and the list as a tree."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from tf_tree_py.core import EdgeInfo

from . import markup
from .control_events import Apply, Shared, when_changed
from ..model.listing import FrameRow, MOST_ROWS, rows

_NONE: Final = '(none yet)'


class FramesPanel:
    """
    The list of frames of one page.

    :ivar fixed_frame: the fixed frame that was selected; None: none was selected.
    """

    def __init__(self, gui: Any, fixed_frame: str | None, on_choice: Callable[[str], None],
                 apply: Apply) -> None:
        """
        Make the controls.

        :param on_choice: is called with a frame when it is clicked in the list.
        :param apply: calls an action between two pictures.
        """
        self.fixed_frame = fixed_frame
        self._rows: dict[str, FrameRow] = {}
        self._unfolded: set[str] = set()
        self._on_choice = on_choice
        self._fixed = gui.add_dropdown('fixed frame', (fixed_frame or _NONE,),
                                       hint='Everything is drawn in this frame.')
        self._fixed_frame = Shared(self._fixed, apply, self._fix)
        self._search = gui.add_text('search', '')
        self._style = gui.add_html(markup.style_of_list((), (), (), None))
        self._list = gui.add_button_group('', (_NONE,), visible=False)
        self._more = gui.add_html('')
        when_changed(self._search, apply)
        self._list.on_click(lambda event: apply(lambda: self._pressed(event.target.value)))

    def refresh(self, edges: Sequence[EdgeInfo], fixed_frame: str, stale: Iterable[str],
                hidden: Iterable[str], chosen: str | None) -> None:
        """Show the frames of the tree; only changes are sent to the browser."""
        self._refresh_fixed(edges, fixed_frame)
        found = rows(edges, self._search.value, self._unfolded)
        shown = found[:MOST_ROWS]
        self._rows = {markup.text_of(row): row for row in shown}
        self._list.visible = bool(shown)
        if shown and self._list.options != tuple(self._rows):
            self._list.options = tuple(self._rows)
        self._style.content = markup.style_of_list([*self._rows.values()], stale, hidden, chosen)
        more = len(found) - len(shown)
        self._more.content = markup.note(
            f'and {more} more: search to find them' if more else
            '● moves, ○ is static; grey is stale' if found else 'no frame')

    def _refresh_fixed(self, edges: Sequence[EdgeInfo], fixed_frame: str) -> None:
        frames = sorted({name for edge in edges for name in (edge.parent, edge.child)}
                        | ({fixed_frame} if fixed_frame else set())) or [_NONE]
        if self._fixed.options != tuple(frames):
            # viser selects another value if the present one is not among the options.
            self._fixed.options = (*frames, *({self._fixed.value} - {*frames}))
        self._fixed_frame.show(fixed_frame or _NONE)
        if self._fixed.options != tuple(frames):
            self._fixed.options = tuple(frames)

    def _fix(self, frame: str) -> None:
        if frame != _NONE:
            self.fixed_frame = frame

    def _pressed(self, text: str) -> None:
        row = self._rows.get(text)
        if row is None:
            return
        if row.folds is None:
            self._on_choice(row.frame)
        else:
            self._unfolded ^= {row.frame}
