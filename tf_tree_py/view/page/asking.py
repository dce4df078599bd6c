"""How the controls of a page ask for something to be done, whose events come from any thread."""

from collections.abc import Callable
from typing import Any, TypeAlias

Ask: TypeAlias = Callable[[Callable[[], None]], None]
"""Takes a function and calls it between two pictures."""


def when_changed(control: Any, ask: Ask, action: Callable[[], None]) -> None:
    """Let something be done whenever somebody changes a control, but not when we do."""
    def changed(event: Any) -> None:
        if event.client is not None:
            ask(action)

    control.on_update(changed)


def nothing_else() -> None:
    """Do no more than what every change brings about: the page is drawn anew."""
