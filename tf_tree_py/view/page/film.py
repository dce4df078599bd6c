# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Records the picture of a page over a stretch of time as an animated GIF."""

from collections.abc import Callable, Sequence
import io
import threading
from typing import Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.times import Stamps

if TYPE_CHECKING:
    from PIL.Image import Image
    from viser import ClientHandle

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
    oldest, newest = window
    length = min(round(seconds * 1e9), newest - oldest)
    begin = max(oldest, min(stamp, newest - length))
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
            self._client.send_file_download(_NAME, gif_of(pictures), save_immediately=True)


def _with_few_colours(pixels: npt.NDArray[np.uint8]) -> 'Image':
    """Return a picture as GIF stores it, which takes a third of the memory."""
    from PIL.Image import fromarray
    return fromarray(pixels[:, :, :3]).quantize(_COLOURS)


def gif_of(pictures: Sequence['Image']) -> bytes:
    """Return an animated GIF of some pictures, which repeats endlessly."""
    data = io.BytesIO()
    pictures[0].save(data, 'GIF', save_all=True, append_images=pictures[1:],
                     duration=round(1000.0 / RATE_HZ), loop=0)
    return data.getvalue()
