# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Connects the events of a page's controls, which come from any thread, to actions."""

from collections.abc import Callable
from typing import Any, TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from viser import GuiApi as GuiApi
else:  # only for annotations: importing viser takes long
    GuiApi = object

Apply: TypeAlias = Callable[[Callable[[], None]], None]
"""Calls a function between two pictures; the next picture shows its effect."""


def _no_action() -> None:
    pass


def when_changed(control: Any, apply: Apply, action: Callable[[], None] = _no_action) -> None:
    """
    Call an action when a person, and not the program, changes a control.

    :param action: if it is not given, the page is only drawn again.
    """
    def changed(event: Any) -> None:
        if event.client is not None:
            apply(action)

    control.on_update(changed)


class Shared:
    """
    The value of a control that both the program and a person set.

    A person's value is there before its event, which comes from another thread; until then the
    program must not overwrite it.
    """

    def __init__(self, control: Any, apply: Apply, action: Callable[[Any], None]) -> None:
        """
        Observe a control.

        :param apply: calls an action between two pictures.
        :param action: is called with the value that a person has set.
        """
        self._control = control
        self._shown = control.value
        when_changed(control, apply, lambda: action(self._read()))

    def show(self, value: object) -> None:
        """Set the value, unless a person has just set another one."""
        if self._control.value == self._shown != value:
            self._control.value = value
            self._read()

    def _read(self) -> Any:
        self._shown = self._control.value
        return self._shown
