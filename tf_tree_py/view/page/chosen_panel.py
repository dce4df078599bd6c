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

"""What is told of the chosen frame, and what can be done with it."""

from collections.abc import Callable, Iterable
from typing import Any

from . import markup
from .asking import Ask, nothing_else, when_changed
from ..shown.facts import Fact


class ChosenPanel:
    """
    The controls of the chosen frame of one page.

    :ivar frame: the chosen one; None: there is none.
    """

    def __init__(self, gui: Any, hidden: set[str], look_at: Callable[[], None],
                 ask: Ask) -> None:
        """
        Make the controls.

        :param hidden: the frames that are switched off; changed here.
        :param look_at: turns the camera to the chosen frame.
        :param ask: lets something be done between two pictures.
        """
        self.frame: str | None = None
        self._hidden = hidden
        self._facts = gui.add_html(markup.note('click a frame, or its name in the list'))
        self._shown = gui.add_checkbox('show it', True, disabled=True)
        self._trail = gui.add_checkbox('trail', False, hint='Where it was in the whole window.')
        self._follow = gui.add_checkbox('follow', False, hint='It stays where it is on the page, '
                                        'and everything else moves.')
        self._look_at = gui.add_button('look at it', disabled=True)
        when_changed(self._shown, ask, self._show)
        when_changed(self._trail, ask, nothing_else)
        when_changed(self._follow, ask, nothing_else)
        self._look_at.on_click(lambda _: ask(look_at))

    @property
    def trail(self) -> str | None:
        """Return the frame whose trail is wanted."""
        return self.frame if self._trail.value else None

    @property
    def followed(self) -> str | None:
        """Return the frame that the camera is to follow."""
        return self.frame if self._follow.value else None

    def choose(self, frame: str) -> None:
        """Take another frame."""
        self.frame = frame
        self._shown.disabled = self._look_at.disabled = False
        self._shown.value = frame not in self._hidden

    def refresh(self, facts: Iterable[Fact]) -> None:
        """Show what there is to tell of it."""
        if self.frame is not None:
            self._facts.content = markup.table([('frame', self.frame), *facts])

    def _show(self) -> None:
        if self.frame is None:
            return
        if self._shown.value:
            self._hidden.discard(self.frame)
        else:
            self._hidden.add(self.frame)
