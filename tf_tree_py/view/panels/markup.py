# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pieces of HTML for the controls of a page. Names of frames and topics are escaped."""

from collections.abc import Iterable, Sequence
import html

from ..model.facts import Fact, FrameRow

# viser centres the buttons of a group, side by side, behind a label. The list of frames needs a
# column of lines, and the findings need cards. A marker in front of a group selects its style.
_BARE = 'div:has(> .tf-bare) + div'
_LIST = 'div:has(> .tf-frames) + div'
_CARDS = 'div:has(> .tf-cards) + div'
_COLUMN = '{0} div:has(> button) {{flex-direction: column; flex-wrap: nowrap;}}'
_STYLE = f"""
{_BARE} div:has(> p), {_LIST} div:has(> p), {_CARDS} div:has(> p) {{display: none;}}
{_COLUMN.format(_LIST)} {_COLUMN.format(_CARDS)}
{_LIST} {{max-height: 38vh; overflow: auto;}}
{_LIST} div:has(> button) {{gap: 0 !important; min-width: 100%; width: max-content;}}
{_LIST} button {{border: none; border-radius: 0; flex: none !important; padding: 0 2px;
  height: 1.5em; align-self: stretch; color: inherit;}}
{_LIST} .mantine-Button-inner, {_CARDS} .mantine-Button-inner {{justify-content: flex-start;}}
{_LIST} .mantine-Button-label {{white-space: pre; font-family: monospace;}}
{_CARDS} button {{height: auto; flex: none !important; padding: 4px 6px; color: inherit;
  border-color: rgba(128, 128, 128, 0.4); min-width: 0 !important; align-self: stretch;}}
{_CARDS} .mantine-Button-label {{white-space: pre-wrap; overflow-wrap: anywhere;
  text-align: left; font-weight: normal; line-height: 1.35;}}
{_CARDS} .mantine-Button-label::first-line {{font-weight: bold;}}
"""
_PADDING = 'padding: 0 0.6em 0.5em; font-size: 0.85em;'
_STALE = 'color: #999; font-style: italic;'
_HIDDEN = 'opacity: 0.45; text-decoration: line-through;'
_CHOSEN = 'background: rgba(220, 30, 140, 0.18); font-weight: bold;'
_FOLD = 'opacity: 0.6;'
_HEAD = 26


def text_of(row: FrameRow) -> str:
    """Return a frame's line in the list: with a filled dot if it moves, an empty one if not."""
    if row.folds is not None:
        return f'{row.lead}{row.folds}'
    mark = {None: '', True: '○ ', False: '● '}[row.static]
    return f'{row.lead}{mark}{row.frame}'


def style_of_list(rows: Sequence[FrameRow], stale: Iterable[str], hidden: Iterable[str],
                  chosen: str | None) -> str:
    """Return the style of the list of frames, and the marker in front of it."""
    places = {row.frame: number for number, row in enumerate(rows, start=1) if row.folds is None}
    rules = [f'{_LIST} button:nth-child({places[frame]}) {{{style}}}'
             for frames, style in ((stale, _STALE), (hidden, _HIDDEN), ([chosen], _CHOSEN))
             for frame in frames if frame in places]
    rules += [f'{_LIST} button:nth-child({number}) {{{_FOLD}}}'
              for number, row in enumerate(rows, start=1) if row.folds is not None]
    return f'<style>{_STYLE}{" ".join(rules)}</style><div class="tf-frames"></div>'


def style_of_cards(chosen: int | None) -> str:
    """Return the style of the findings, and the marker in front of them."""
    rule = '' if chosen is None else f'{_CARDS} button:nth-child({chosen + 1}) {{{_CHOSEN}}}'
    return f'<style>{_STYLE}{rule}</style><div class="tf-cards"></div>'


def status(tree_name: str, text: str) -> str:
    """Return the name of the tree, and the moment that the page shows."""
    # The title of the panel cuts long names off.
    name = '' if len(tree_name) <= _HEAD else (
        f'<div style="{_PADDING} overflow-wrap: anywhere;">{html.escape(tree_name)}</div>')
    return (f'{name}<div class="tf-status" style="{_PADDING}"><b>{html.escape(text)}</b></div>')


def bare() -> str:
    """Return a marker in front of a group of buttons that has no label."""
    return f'<style>{_STYLE}</style><div class="tf-bare"></div>'


def note(text: str) -> str:
    """Return a short text."""
    return f'<div style="{_PADDING} opacity: 0.7;">{html.escape(text)}</div>'


def warnings(sentences: Iterable[str]) -> str:
    """Return warnings, one line each."""
    lines = ''.join(f'<div style="margin-top: 0.3em; overflow-wrap: anywhere;">▲ '
                    f'{html.escape(sentence)}</div>' for sentence in sentences)
    return f'<div class="tf-warnings" style="{_PADDING} color: #d9480f;">{lines}</div>'


def table(facts: Iterable[Fact]) -> str:
    """Return facts as a table with a narrow column of names, and values that wrap."""
    rows = ''.join(
        '<tr style="border-top: 1px solid rgba(128, 128, 128, 0.2);">'
        '<td style="opacity: 0.65; padding: 2px 0.6em 2px 0; vertical-align: top; '
        f'overflow-wrap: anywhere;">{html.escape(name)}</td><td style="padding: 2px 0; '
        f'overflow-wrap: anywhere; font-variant-numeric: tabular-nums;">{html.escape(value)}</td>'
        '</tr>' for name, value in facts)
    return (f'<div style="{_PADDING}"><table class="tf-facts" style="width: 100%; '
            'table-layout: fixed; border-collapse: collapse; line-height: 1.35;">'
            f'<colgroup><col style="width: 34%;"><col></colgroup>{rows}</table></div>')
