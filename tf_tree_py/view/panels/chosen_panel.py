# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The facts about the chosen frame, and its controls."""

from collections.abc import Callable, Iterable
from typing import Any

from . import markup
from .control_events import Apply, when_changed
from ..model.facts import Fact


class ChosenPanel:
    """
    The controls of the chosen frame of one page.

    :ivar frame: the chosen frame; None: no frame is chosen.
    """

    def __init__(self, gui: Any, hidden: set[str], look_at: Callable[[], None],
                 apply: Apply) -> None:
        """
        Make the controls.

        :param hidden: the frames that are switched off, which the controls change.
        :param look_at: turns the camera to the chosen frame.
        :param apply: calls an action between two pictures.
        """
        self.frame: str | None = None
        self._hidden = hidden
        self._facts = gui.add_html(_NONE)
        self._look_at = gui.add_button('look at it', disabled=True)
        self._shown = gui.add_checkbox('show it', True, disabled=True)
        self._trail = gui.add_checkbox('trail', False, hint='Its path over the whole window.')
        self._follow = gui.add_checkbox('follow', False, hint='Keep it still on the page, while '
                                        'everything else moves.')
        when_changed(self._shown, apply, self._show)
        when_changed(self._trail, apply)
        when_changed(self._follow, apply)
        self._look_at.on_click(lambda _: apply(look_at))

    @property
    def trail(self) -> str | None:
        """Return the frame whose trail is shown; None: no trail is shown."""
        return self.frame if self._trail.value else None

    @property
    def followed(self) -> str | None:
        """Return the frame that the camera follows; None: it follows no frame."""
        return self.frame if self._follow.value else None

    def choose(self, frame: str | None) -> None:
        """Choose another frame; None: no frame."""
        self.frame = frame
        self._shown.disabled = self._look_at.disabled = frame is None
        self._shown.value = frame not in self._hidden
        if frame is None:
            self._facts.content = _NONE

    def refresh(self, facts: Iterable[Fact]) -> None:
        """Show the facts about the chosen frame."""
        if self.frame is not None:
            self._facts.content = markup.table([('frame', self.frame), *facts])

    def _show(self) -> None:
        if self.frame is None:
            return
        if self._shown.value:
            self._hidden.discard(self.frame)
        else:
            self._hidden.add(self.frame)


_NONE = markup.note('click a frame, or its name in the list; click again to deselect it')
