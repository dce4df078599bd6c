# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The controls of the frames: the fixed frame, a search, and the list as a tree.

Also the facts about the chosen frame, and the findings. A click on a finding marks its frames and
shows its time.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from tf_tree_py.core import EdgeInfo
from tf_tree_py.health.checks.finding import Finding

from . import markup
from .control_events import Apply, GuiApi, Shared, when_changed
from ..model.facts import Fact, FrameRow, MOST_ROWS, rows

_NONE: Final = '(none yet)'


class FramesPanel:
    """
    The list of frames of one page.

    :ivar fixed_frame: the fixed frame that was selected; None: none was selected.
    """

    def __init__(self, gui: GuiApi, fixed_frame: str | None, on_choice: Callable[[str], None],
                 apply: Apply) -> None:
        """
        Make the controls.

        :param on_choice: is called with a frame when it is clicked in the list.
        :param apply: calls an action between two pictures.
        """
        self.fixed_frame = fixed_frame
        self._rows: dict[str, FrameRow] = {}
        self._unfolded: set[str] = set()
        self._on_choice = on_choice
        self._fixed = gui.add_dropdown('fixed frame', (fixed_frame or _NONE,),
                                       hint='Everything is drawn in this frame.')
        self._fixed_frame = Shared(self._fixed, apply, self._fix)
        self._search = gui.add_text('search', '')
        self._style = gui.add_html(markup.style_of_list((), (), (), None))
        self._list = gui.add_button_group('', (_NONE,), visible=False)
        self._more = gui.add_html('')
        when_changed(self._search, apply)
        self._list.on_click(lambda event: apply(lambda: self._pressed(event.target.value)))

    def refresh(self, edges: Sequence[EdgeInfo], fixed_frame: str, stale: Iterable[str],
                hidden: Iterable[str], chosen: str | None) -> None:
        """Show the frames of the tree; only changes are sent to the browser."""
        self._refresh_fixed(edges, fixed_frame)
        found = rows(edges, self._search.value, self._unfolded)
        shown = found[:MOST_ROWS]
        self._rows = {markup.text_of(row): row for row in shown}
        self._list.visible = bool(shown)
        if shown and self._list.options != tuple(self._rows):
            self._list.options = tuple(self._rows)
        self._style.content = markup.style_of_list([*self._rows.values()], stale, hidden, chosen)
        more = len(found) - len(shown)
        self._more.content = markup.note(
            f'and {more} more: search to find them' if more else
            '● moves, ○ is static; grey is stale' if found else 'no frame')

    def _refresh_fixed(self, edges: Sequence[EdgeInfo], fixed_frame: str) -> None:
        frames = sorted({name for edge in edges for name in (edge.parent, edge.child)}
                        | ({fixed_frame} if fixed_frame else set())) or [_NONE]
        if self._fixed.options != tuple(frames):
            # viser selects another value if the present one is not among the options.
            self._fixed.options = (*frames, *({self._fixed.value} - {*frames}))
        self._fixed_frame.show(fixed_frame or _NONE)
        if self._fixed.options != tuple(frames):
            self._fixed.options = tuple(frames)

    def _fix(self, frame: str) -> None:
        if frame != _NONE:
            self.fixed_frame = frame

    def _pressed(self, text: str) -> None:
        row = self._rows.get(text)
        if row is None:
            return
        if row.folds is None:
            self._on_choice(row.frame)
        else:
            self._unfolded ^= {row.frame}


# --- the chosen frame

class ChosenPanel:
    """
    The controls of the chosen frame of one page.

    :ivar frame: the chosen frame; None: no frame is chosen.
    """

    def __init__(self, gui: Any, hidden: set[str], look_at: Callable[[], None],
                 apply: Apply) -> None:
        """
        Make the controls.

        :param hidden: the frames that are switched off, which the controls change.
        :param look_at: turns the camera to the chosen frame.
        :param apply: calls an action between two pictures.
        """
        self.frame: str | None = None
        self._hidden = hidden
        self._facts = gui.add_html(_NOT_CHOSEN)
        self._look_at = gui.add_button('look at it', disabled=True)
        self._shown = gui.add_checkbox('show it', True, disabled=True)
        self._trail = gui.add_checkbox('trail', False, hint='Its path over the whole window.')
        self._follow = gui.add_checkbox('follow', False, hint='Keep it still on the page, while '
                                        'everything else moves.')
        when_changed(self._shown, apply, self._show)
        when_changed(self._trail, apply)
        when_changed(self._follow, apply)
        self._look_at.on_click(lambda _: apply(look_at))

    @property
    def trail(self) -> str | None:
        """Return the frame whose trail is shown; None: no trail is shown."""
        return self.frame if self._trail.value else None

    @property
    def followed(self) -> str | None:
        """Return the frame that the camera follows; None: it follows no frame."""
        return self.frame if self._follow.value else None

    def choose(self, frame: str | None) -> None:
        """Choose another frame; None: no frame."""
        self.frame = frame
        self._shown.disabled = self._look_at.disabled = frame is None
        self._shown.value = frame not in self._hidden
        if frame is None:
            self._facts.content = _NOT_CHOSEN

    def refresh(self, facts: Iterable[Fact]) -> None:
        """Show the facts about the chosen frame."""
        if self.frame is not None:
            self._facts.content = markup.table([('frame', self.frame), *facts])

    def _show(self) -> None:
        if self.frame is None:
            return
        if self._shown.value:
            self._hidden.discard(self.frame)
        else:
            self._hidden.add(self.frame)


_NOT_CHOSEN = markup.note('click a frame, or its name in the list; click again to deselect it')


# --- findings

_MOST: Final = 12
_SIGNS: Final = {'error': '✖', 'warning': '▲', 'note': '●'}


class FindingsPanel:
    """
    The findings on one page.

    :ivar frames: the frames of the selected finding, which are marked.
    """

    def __init__(self, gui: GuiApi, go_to: Callable[[Finding], None], apply: Apply) -> None:
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
        ('from', finding.senders), ('cause', finding.cause), ('fix', finding.fix))
        if text]
    return '\n'.join(lines)
