# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The controls of a page's appearance: what is drawn, at which size, dark or light.

Also the buttons that turn the camera, and a slider for each joint of a robot without transforms.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from . import markup
from .control_events import Apply, GuiApi, Shared, when_changed
from ..robot.resting_robot import RestingRobot
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
            when_changed(control, apply, self._read)
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

    def _read(self) -> None:
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


# --- joints

_STEPS = 1000.0


class JointsPanel:
    """The joints of a resting robot on one page. All pages show the same robot."""

    def __init__(self, gui: GuiApi, robot: RestingRobot, apply: Apply) -> None:
        """Make the sliders."""
        self._robot = robot
        self._folder = gui.add_folder(f'joints ({len(robot.sliders)})',
                                      expand_by_default=len(robot.sliders) <= 8)
        self._positions: dict[str, Shared] = {}
        with self._folder:
            gui.add_button('all at rest').on_click(lambda _: apply(self._rest))
            for slider in robot.sliders:
                step = (slider.most - slider.least) / _STEPS
                control = gui.add_slider(slider.variable, min=slider.least, max=slider.most,
                                         step=step, initial_value=slider.rest)
                self._positions[slider.variable] = Shared(
                    control, apply, partial(self._set, slider.variable))

    def refresh(self, visible: bool) -> None:
        """
        Show the positions of the joints.

        :param visible: False while transforms move the robot.
        """
        self._folder.visible = visible
        for variable, position in self._robot.positions.items():
            self._positions[variable].show(position)

    def _set(self, variable: str, position: float) -> None:
        self._robot.move(variable, float(position))

    def _rest(self) -> None:
        for slider in self._robot.sliders:
            self._robot.move(slider.variable, slider.rest)


# --- views

_ROBOT, _ALL = 'see the robot', 'see all'
_BUTTONS: Final = (_ROBOT, _ALL)


class ViewButtons:
    """The buttons that turn the camera of one page."""

    def __init__(self, gui: GuiApi, see: Callable[[bool], None], apply: Apply) -> None:
        """
        Make the buttons.

        :param see: turns the camera to all frames, or only to those of the robot.
        :param apply: calls an action between two pictures.
        """
        gui.add_html(markup.bare())
        buttons = gui.add_button_group('', _BUTTONS)
        buttons.on_click(lambda event: apply(lambda: see(event.target.value == _ALL)))
