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

"""Pieces of HTML for the controls of a page. Strangers' names are escaped."""

from collections.abc import Iterable, Sequence
import html

from ..shown.facts import Fact
from ..shown.listing import Row

# viser's buttons stand side by side behind a label, and in the middle; a tree is a column of
# lines. The group of buttons behind a marker is the one that is meant.
_BARE = 'div:has(> .tf-bare) + div'
_LIST = 'div:has(> .tf-frames) + div'
_STYLE = f"""
{_BARE} div:has(> p), {_LIST} div:has(> p) {{display: none;}}
{_LIST} {{max-height: 38vh; overflow: auto;}}
{_LIST} div:has(> button) {{flex-direction: column; flex-wrap: nowrap; gap: 0 !important;}}
{_LIST} button {{border: none; border-radius: 0; flex: none !important; padding: 0 2px;
  height: 1.5em; align-self: stretch; color: inherit;}}
{_LIST} .mantine-Button-inner {{justify-content: flex-start;}}
{_LIST} .mantine-Button-label {{white-space: pre; font-family: monospace;}}
"""
_PADDING = 'padding: 0 0.6em 0.5em; font-size: 0.85em;'
_STALE = 'color: #999; font-style: italic;'
_HIDDEN = 'opacity: 0.45; text-decoration: line-through;'
_CHOSEN = 'background: rgba(220, 30, 140, 0.18); font-weight: bold;'


def text_of(row: Row) -> str:
    """Return a frame's line in the list: a filled dot moves, an empty one is static."""
    mark = {None: '', True: '○ ', False: '● '}[row.static]
    return f'{row.lead}{mark}{row.frame}'


def style_of_list(rows: Sequence[Row], stale: Iterable[str], hidden: Iterable[str],
                  chosen: str | None) -> str:
    """Return the style of the list of frames, and the marker in front of it."""
    places = {row.frame: number for number, row in enumerate(rows, start=1)}
    rules = [f'{_LIST} button:nth-child({places[frame]}) {{{style}}}'
             for frames, style in ((stale, _STALE), (hidden, _HIDDEN), ([chosen], _CHOSEN))
             for frame in frames if frame in places]
    return f'<style>{_STYLE}{" ".join(rules)}</style><div class="tf-frames"></div>'


def status(text: str) -> str:
    """Return the line that says which moment the page shows."""
    return f'<div class="tf-status" style="{_PADDING}"><b>{html.escape(text)}</b></div>'


def bare() -> str:
    """Return a marker in front of a group of buttons that has no label."""
    return '<div class="tf-bare"></div>'


def note(text: str) -> str:
    """Return a short text."""
    return f'<div style="{_PADDING} opacity: 0.7;">{html.escape(text)}</div>'


def table(facts: Iterable[Fact]) -> str:
    """Return facts as a table that wraps, for a narrow panel."""
    rows = ''.join(
        f'<tr><td style="opacity: 0.65; padding-right: 0.7em; vertical-align: top;">'
        f'{html.escape(name)}</td><td style="overflow-wrap: anywhere;">{html.escape(value)}</td>'
        '</tr>' for name, value in facts)
    return f'<table class="tf-facts" style="{_PADDING} font-size: 0.85em;">{rows}</table>'
