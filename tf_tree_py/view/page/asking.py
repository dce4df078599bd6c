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
