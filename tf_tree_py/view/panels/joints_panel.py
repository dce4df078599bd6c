# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A slider for each joint of a robot without transforms."""

from functools import partial
from typing import Any

from .control_events import Apply, Shared
from ..robot.resting_robot import RestingRobot

_STEPS = 1000.0


class JointsPanel:
    """The joints of a resting robot on one page. All pages show the same robot."""

    def __init__(self, gui: Any, robot: RestingRobot, apply: Apply) -> None:
        """Make the sliders."""
        self._robot = robot
        self._folder = gui.add_folder(f'joints ({len(robot.sliders)})',
                                      expand_by_default=len(robot.sliders) <= 8)
        self._positions: dict[str, Shared] = {}
        with self._folder:
            gui.add_button('all at rest').on_click(lambda _: apply(self._rest))
            for slider in robot.sliders:
                step = (slider.most - slider.least) / _STEPS
                control = gui.add_slider(
                    slider.variable, min=slider.least, max=slider.most, step=step,
                    initial_value=slider.rest)
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
