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

"""What is drawn, how big, in the dark or in the light."""

from collections.abc import Callable
from typing import Any

from .asking import Ask, when_changed
from .scene import Look


class LookPanel:
    """The controls of how one page looks."""

    def __init__(self, gui: Any, look: Look, see_all: Callable[[], None],
                 ask: Ask) -> None:
        """
        Make the controls.

        :param look: changed here.
        :param see_all: lets the camera look at all frames.
        :param ask: lets something be done between two pictures.
        """
        self._gui = gui
        self._look = look
        self._length = gui.add_number('axes [m]', look.axes_length, min=0.001, step=0.01)
        self._boxes = {name: gui.add_checkbox(label, getattr(look, name)) for name, label in (
            ('axes', 'axes'), ('names', 'names'), ('lines', 'lines to parents'),
            ('links', 'links of the robot'))}
        self._dark = gui.add_checkbox('dark', look.dark)
        gui.add_button('see all').on_click(lambda _: ask(see_all))
        for control in (self._length, *self._boxes.values()):
            when_changed(control, ask, self._take)
        when_changed(self._dark, ask, self.apply_theme)
        self.apply_theme()

    def set_length(self, length: float) -> None:
        """Begin with another size of the axes, metres."""
        self._look.axes_length = self._length.value = length

    def _take(self) -> None:
        self._look.axes_length = max(float(self._length.value), 0.001)
        for name, box in self._boxes.items():
            setattr(self._look, name, box.value)

    def apply_theme(self) -> None:
        """Tell the page whether it is dark."""
        self._look.dark = self._dark.value
        self._gui.configure_theme(dark_mode=self._dark.value, show_logo=False,
                                  show_share_button=False, control_width='medium')
