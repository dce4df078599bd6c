# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Connects the events of a page's controls, which come from any thread, to actions."""

from collections.abc import Callable
from typing import Any, TypeAlias

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
