# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A slider for each joint of a robot without transforms."""

from functools import partial
from typing import Any

from .control_events import Apply, when_changed
from ..robot.resting_robot import RestingRobot

_STEPS = 1000.0


class JointsPanel:
    """The joints of a resting robot on one page. All pages show the same robot."""

    def __init__(self, gui: Any, robot: RestingRobot, apply: Apply) -> None:
        """Make the sliders."""
        self._robot = robot
        self._folder = gui.add_folder(f'joints ({len(robot.sliders)})',
                                      expand_by_default=len(robot.sliders) <= 8)
        self._sliders: dict[str, Any] = {}
        # The positions that the program set last. A slider elsewhere was moved by a person, and
        # its event is still on the way.
        self._shown: dict[str, float] = {}
        with self._folder:
            gui.add_button('all at rest').on_click(lambda _: apply(self._rest))
            for slider in robot.sliders:
                step = (slider.most - slider.least) / _STEPS
                self._sliders[slider.variable] = control = gui.add_slider(
                    slider.variable, min=slider.least, max=slider.most, step=step,
                    initial_value=slider.rest)
                self._shown[slider.variable] = control.value
                when_changed(control, apply, partial(self._set, slider.variable))

    def refresh(self, visible: bool) -> None:
        """
        Show the positions of the joints.

        :param visible: False while transforms move the robot.
        """
        self._folder.visible = visible
        for variable, position in self._robot.positions.items():
            slider = self._sliders[variable]
            if slider.value == self._shown[variable] != position:
                slider.value = position
                self._shown[variable] = slider.value

    def _set(self, variable: str) -> None:
        self._shown[variable] = position = self._sliders[variable].value
        self._robot.move(variable, float(position))

    def _rest(self) -> None:
        for slider in self._robot.sliders:
            self._robot.move(slider.variable, slider.rest)
