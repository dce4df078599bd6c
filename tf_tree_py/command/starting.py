# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Entry points of programs: they handle signals before any import that takes time."""

from collections.abc import Callable
from importlib import import_module

from . import signals
from .endings import INTERRUPTED


def starter(module: str, main: str = 'main') -> Callable[[], int]:
    """Return a function that runs ``main`` of a module; a signal ends the import at once."""
    def start() -> int:
        signals.end_at_once(INTERRUPTED)
        status: int = getattr(import_module(module), main)()
        return status

    return start
