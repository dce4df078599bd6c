# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The findings on a page. A click on one marks its frames and shows its time."""

from collections.abc import Callable, Sequence
from typing import Any, Final

from tf_tree_py.health.checks.finding import Finding

from . import markup
from .control_events import Apply

_MOST: Final = 12
_SIGNS: Final = {'error': '✖', 'warning': '▲', 'note': '●'}


class FindingsPanel:
    """
    The findings on one page.

    :ivar frames: the frames of the selected finding, which are marked.
    """

    def __init__(self, gui: Any, go_to: Callable[[Finding], None], apply: Apply) -> None:
        """
        Make the controls.

        :param go_to: shows the time of a finding.
        :param apply: calls an action between two pictures.
        """
        self.frames: tuple[str, ...] = ()
        self._by_text: dict[str, Finding] = {}
        self._chosen: tuple[str, tuple[str, ...]] | None = None
        self._go_to = go_to
        self._text = gui.add_html(markup.note('not checked yet'))
        self._style = gui.add_html(markup.style_of_cards(None))
        self._cards = gui.add_button_group('', ('',), visible=False)
        self._cards.on_click(lambda event: apply(lambda: self._pressed(event.target.value)))

    def refresh(self, findings: Sequence[Finding]) -> None:
        """
        Show the present findings.

        :param findings: the most severe first.
        """
        shown = findings[:_MOST]
        self._by_text = {_text(finding): finding for finding in shown}
        self._cards.visible = bool(shown)
        if shown and self._cards.options != tuple(self._by_text):
            self._cards.options = tuple(self._by_text)
        # The numbers of a finding change while it lasts, so it is known by its code and frames.
        keys = [_key(finding) for finding in self._by_text.values()]
        self.frames = self._chosen[1] if self._chosen in keys and self._chosen else ()
        self._style.content = markup.style_of_cards(
            keys.index(self._chosen) if self._chosen in keys else None)
        more = len(findings) - len(shown)
        self._text.content = markup.note(
            'click a finding to mark its frames and go to its time'
            + (f'; {more} more' if more > 0 else '') if findings else 'no problems found')

    def _pressed(self, text: str) -> None:
        finding = self._by_text.get(text)
        if finding is None or _key(finding) == self._chosen:
            self._chosen = None
            return
        self._chosen = _key(finding)
        self._go_to(finding)


def _key(finding: Finding) -> tuple[str, tuple[str, ...]]:
    return finding.code, finding.frames


def _text(finding: Finding) -> str:
    """Return the text of a finding's button."""
    head = (f'{_SIGNS[finding.severity.value]} {finding.severity.value}: {finding.code} '
            f'{" → ".join(finding.frames)}')
    lines = [head, finding.summary]
    lines += [f'{name}: {text}' for name, text in (
        ('from', ', '.join(finding.publishers)), ('cause', finding.cause), ('fix', finding.fix))
        if text]
    return '\n'.join(lines)
