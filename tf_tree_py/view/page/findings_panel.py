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

"""What is wrong with the tree, on one page; each finding marks its frames."""

from collections.abc import Sequence
from typing import Any, Final

from tf_tree_py.core.checks.finding import Finding

from . import markup
from .asking import Ask

_MOST: Final = 12


class FindingsPanel:
    """
    The findings on one page.

    :ivar frames: those of the finding that somebody chose, to be marked.
    """

    def __init__(self, gui: Any, ask: Ask) -> None:
        """
        Make the controls.

        :param ask: lets something be done between two pictures.
        """
        self.frames: tuple[str, ...] = ()
        self._by_text: dict[str, Finding] = {}
        self._chosen: Finding | None = None
        gui.add_html(markup.bare())
        self._buttons = gui.add_button_group('', ('',), visible=False)
        self._text = gui.add_html(markup.note('nothing is known yet'))
        self._buttons.on_click(lambda event: ask(lambda: self._pressed(event.target.value)))

    def refresh(self, findings: Sequence[Finding]) -> None:
        """Show what is wrong now, the worst first."""
        self._by_text = {_title(finding): finding for finding in findings[:_MOST]}
        self._buttons.visible = bool(findings)
        if findings and self._buttons.options != tuple(self._by_text):
            self._buttons.options = tuple(self._by_text)
        # The same finding again may have newer numbers, and one that is over marks nothing.
        chosen = self._chosen and self._by_text.get(_title(self._chosen))
        self._chosen, self.frames = chosen, chosen.frames if chosen else ()
        if chosen:
            self._text.content = markup.table(_told(chosen))
            return
        more = len(findings) - len(self._by_text)
        self._text.content = markup.note(
            f'press one to mark its frames{f"; {more} more" if more > 0 else ""}'
            if findings else 'nothing is wrong')

    def _pressed(self, text: str) -> None:
        chosen = self._by_text.get(text)
        self._chosen = None if chosen is None or chosen is self._chosen else chosen


def _title(finding: Finding) -> str:
    return f'{finding.severity.value}: {finding.code} {" → ".join(finding.frames)}'


def _told(finding: Finding) -> list[tuple[str, str]]:
    return [(name, text) for name, text in (
        (finding.severity.value, finding.code), ('frames', ', '.join(finding.frames)),
        ('what', finding.summary), ('from', ', '.join(finding.publishers)),
        ('cause', finding.cause), ('mend', finding.fix)) if text]
