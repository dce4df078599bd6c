# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buttons that turn the camera."""

from collections.abc import Callable
from typing import Any, Final

from . import markup
from .control_events import Apply

_ROBOT, _ALL = 'see the robot', 'see all'
_BUTTONS: Final = (_ROBOT, _ALL)


class ViewButtons:
    """The buttons that turn the camera of one page."""

    def __init__(self, gui: Any, see: Callable[[bool], None], apply: Apply) -> None:
        """
        Make the buttons.

        :param see: turns the camera to all frames, or only to those of the robot.
        :param apply: calls an action between two pictures.
        """
        gui.add_html(markup.bare())
        buttons = gui.add_button_group('', _BUTTONS)
        buttons.on_click(lambda event: apply(lambda: see(event.target.value == _ALL)))
