# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The controls of a page's appearance: what is drawn, at which size, dark or light."""

from collections.abc import Sequence
from typing import Any, Final

from . import markup
from .control_events import Apply, when_changed
from ..scene.scene import Appearance

_NAMES: Final = ('few', 'all', 'none')
_MOST_MISSING: Final = 8


class AppearancePanel:
    """The controls of the appearance of one page."""

    def __init__(self, gui: Any, look: Appearance, apply: Apply) -> None:
        """
        Make the controls.

        :param look: the appearance that the controls change.
        :param apply: calls an action between two pictures.
        """
        self._gui = gui
        self._look = look
        self._names = gui.add_dropdown(
            'names', _NAMES, initial_value=look.names,
            hint='Names do not overlap: chosen frames and near ones come first.')
        self._length = gui.add_number('axes [m]', look.axes_length, min=0.001, step=0.01,
                                      hint='Starts as half of the median edge length.')
        self._opacity = gui.add_slider('opacity of links', min=0.1, max=1.0, step=0.05,
                                       initial_value=look.opacity)
        self._boxes = {name: gui.add_checkbox(label, getattr(look, name)) for name, label in (
            ('axes', 'axes'), ('lines', 'lines to parents'), ('links', 'links of the robot'),
            ('ground', 'ground'))}
        self._dark = gui.add_checkbox('dark', look.dark)
        self._notes = gui.add_html('')
        for control in (self._names, self._length, self._opacity, *self._boxes.values()):
            when_changed(control, apply, self._take)
        when_changed(self._dark, apply, self.apply_theme)
        self.apply_theme()

    def set_sizes(self, axes_length: float, cell: float) -> None:
        """Set the length of the axes and of a cell of the ground, metres."""
        self._look.axes_length = self._length.value = axes_length
        self._look.cell = cell

    def set_dark(self, dark: bool) -> None:
        """Switch the page to dark or light colours."""
        self._dark.value = dark
        self.apply_theme()

    def refresh(self, missing: Sequence[str]) -> None:
        """
        Show the size of a cell and the shapes that are missing.

        :param missing: shapes that cannot be shown, one sentence each.
        """
        more = len(missing) - _MOST_MISSING
        shown = [*missing[:_MOST_MISSING], *([f'and {more} more'] if more > 0 else [])]
        self._notes.content = markup.note(f'a cell of the ground is {self._look.cell:g} m') + (
            markup.warnings(shown) if shown else '')

    def _take(self) -> None:
        self._look.axes_length = max(float(self._length.value), 0.001)
        self._look.names = self._names.value
        self._look.opacity = float(self._opacity.value)
        for name, box in self._boxes.items():
            setattr(self._look, name, box.value)

    def apply_theme(self) -> None:
        """Switch the page to the colours that the control selects."""
        self._look.dark = self._dark.value
        self._gui.configure_theme(dark_mode=self._dark.value, show_logo=False,
                                  show_share_button=False, control_width='medium')
