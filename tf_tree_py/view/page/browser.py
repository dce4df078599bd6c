# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The browser that shows a page: its address, the size of its picture, and its delay.

viser does not report these, but it can run a script in the browser. The script ``browser.js``
writes its reports into a hidden text field. It also shows a red bar if the server stops.
"""

from collections.abc import Callable
import json
from pathlib import Path
import time
from typing import Final

from viser import ClientHandle
from viser._messages import RunJavascriptMessage

from ..panels.control_events import Apply, when_changed

_SCRIPT: Final = Path(__file__).with_name('browser.js')
_STYLE: Final = '<style>div:has(> .tf-reports) + div {display: none;}</style>'
# A browser without an answer for so long cannot answer; for example, its panel may be closed.
_MUTE_S: Final = 5.0
_LATE_S: Final = 0.4
_LEAST_APART_S: Final = 0.5


class Browser:
    """
    The reports of one browser.

    :ivar size: width and height of the picture, CSS pixels; None: not known yet.
    """

    def __init__(self, client: ClientHandle, apply: Apply, opened: Callable[[str], None],
                 resized: Callable[[], None]) -> None:
        """
        Start the script that reports.

        :param apply: calls an action between two pictures.
        :param opened: is called with the query of the address that was opened.
        :param resized: is called when the size of the picture changes.
        """
        self.size: tuple[float, float] | None = None
        self._client = client
        self._opened, self._resized = opened, resized
        self._query: str | None = None
        self._written: tuple[str, float] = '', 0.0
        self._number = 0
        self._waiting: dict[int, float] = {}
        self._answered = 0.0
        gui = client.gui
        self._beat = gui.add_html(self._pulse())
        self._reports = gui.add_text('tf-reports', '')
        when_changed(self._reports, apply, self._receive)
        self._run(_SCRIPT.read_text(encoding='utf-8'))

    # --- its delay

    def beat(self) -> None:
        """Send a number that the browser sends back."""
        self._number += 1
        self._waiting[self._number] = time.monotonic()
        self._beat.content = self._pulse()

    def late_s(self) -> float:
        """Return the delay between sending and showing, seconds; 0 without an answer."""
        now = time.monotonic()
        waits = [now - sent for sent in self._waiting.values()]
        if not waits or now - self._answered > _MUTE_S:
            self._waiting = {number: sent for number, sent in self._waiting.items()
                             if now - sent < _MUTE_S}
            return 0.0
        return max(waits)

    @property
    def is_behind(self) -> bool:
        """Return whether the browser still has to draw earlier pictures."""
        return self.late_s() > _LATE_S

    def _pulse(self) -> str:
        return f'{_STYLE}<span class="tf-reports" data-beat="{self._number}"></span>'

    # --- its address

    def write(self, query: str) -> None:
        """Write a query into the address, at the low rate that browsers allow."""
        last, written = self._written
        if query == last or time.monotonic() - written < _LEAST_APART_S or self._query is None:
            return
        self._written = query, time.monotonic()
        self._run(f'window.tfWrite?.({json.dumps(query)})')

    def download_picture(self, name: str) -> None:
        """Save the picture in the browser as a file, without the controls."""
        self._run(f'window.tfPicture?.({json.dumps(name)})')

    # --- reports

    def _receive(self) -> None:
        try:
            report = json.loads(self._reports.value)
            beat, query = int(report['beat']), str(report['query'])
            size = float(report['width']), float(report['height'])
        except (ValueError, KeyError, TypeError):
            return  # it is not a report of the script
        self._answered = time.monotonic()
        self._waiting = {number: sent for number, sent in self._waiting.items() if number > beat}
        if min(size) > 0.0 and size != self.size:
            self.size = size
            self._resized()
        if query != self._query:
            self._query = query
            self._opened(query)

    def _run(self, script: str) -> None:
        self._client.gui._websock_interface.queue_message(RunJavascriptMessage(script))
