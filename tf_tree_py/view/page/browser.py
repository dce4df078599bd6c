# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The browser that shows a page: its address, the size of its picture, and its delay; and films.

viser does not report these, but it can run a script in the browser. The script ``browser.js``
writes its reports into a hidden text field. It also shows a red bar if the server stops. A film
records the picture over a stretch of time as an animated GIF.
"""

from collections.abc import Callable, Sequence
import io
import json
from pathlib import Path
import threading
import time
from typing import Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.times import Stamps
from viser import ClientHandle
from viser._messages import RunJavascriptMessage

from ..panels.control_events import Apply, when_changed

if TYPE_CHECKING:
    from PIL.Image import Image

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


# --- films

RATE_HZ: Final = 10.0
MOST_FRAMES: Final = 300


def film_stamps(window: tuple[int, int], stamp: int, seconds: float, speed: float) -> Stamps:
    """
    Return the stamps of the frames of a film, nanoseconds.

    The film begins at the moment that the page shows. It begins earlier if less than its length
    is left before the end of the window, so that a live page shows the last seconds.

    :param window: the oldest and the newest stamp that the page can show, nanoseconds.
    :param stamp: of the moment that the page shows, nanoseconds.
    :param seconds: length of the film in recorded time.
    :param speed: recorded seconds per second of the film.
    """
    oldest, latest = window
    length = min(round(seconds * 1e9), latest - oldest)
    begin = max(oldest, min(stamp, latest - length))
    count = round(length * 1e-9 / speed * RATE_HZ) + 1
    return np.linspace(begin, begin + length, min(max(count, 1), MOST_FRAMES)).astype(np.int64)


# --- recording

_NAME: Final = 'tf_view.gif'
_WIDEST: Final = 640
# A browser does not draw a tab that is hidden, so a picture may never arrive.
_PATIENCE_S: Final = 60.0
_COLOURS: Final = 128


class Film:
    """
    Records one film at a time, in a thread of its own, because the browser draws each picture.

    :ivar progress: the pictures that exist and the pictures that are needed; None: no film is
        being recorded.
    """

    def __init__(self, client: 'ClientHandle', show: Callable[[int], None]) -> None:
        """
        Begin without a film.

        :param client: viser's handle of the page.
        :param show: draws the moment at a stamp.
        """
        self.progress: tuple[int, int] | None = None
        self._client = client
        self._show = show
        self._stopped = threading.Event()

    def start(self, stamps: Stamps, size: tuple[float, float]) -> None:
        """
        Record a film and send it to the browser as a download.

        :param stamps: of the pictures, nanoseconds.
        :param size: width and height of the page's picture, CSS pixels.
        """
        if self.progress is not None:
            return
        scale = min(_WIDEST / size[0], 1.0)
        pixels = round(size[0] * scale), round(size[1] * scale)
        self.progress = 0, len(stamps)
        self._stopped.clear()
        threading.Thread(target=self._record, args=(stamps, pixels), name='film',
                         daemon=True).start()

    def stop(self) -> None:
        """End the film with the pictures that exist."""
        self._stopped.set()

    def _record(self, stamps: Stamps, size: tuple[int, int]) -> None:
        pictures: list[Image] = []
        try:
            for number, stamp in enumerate(stamps.tolist()):
                self.progress = number, len(stamps)
                if self._stopped.is_set():
                    break
                self._show(stamp)
                pictures.append(_with_few_colours(self._client.get_render(
                    size[1], size[0], timeout=_PATIENCE_S)))
        except (RuntimeError, TimeoutError):
            pass  # the page was closed or hidden: keep the pictures that exist
        finally:
            self.progress = None
        if pictures:
            self._client.send_file_download(_NAME, _gif_of(pictures), save_immediately=True)


def _with_few_colours(pixels: npt.NDArray[np.uint8]) -> 'Image':
    """Return a picture as GIF stores it, which takes a third of the memory."""
    from PIL.Image import fromarray
    return fromarray(pixels[:, :, :3]).quantize(_COLOURS)


def _gif_of(pictures: Sequence['Image']) -> bytes:
    """Return an animated GIF of some pictures, which repeats endlessly."""
    data = io.BytesIO()
    pictures[0].save(data, 'GIF', save_all=True, append_images=pictures[1:],
                     duration=round(1000.0 / RATE_HZ), loop=0)
    return data.getvalue()
