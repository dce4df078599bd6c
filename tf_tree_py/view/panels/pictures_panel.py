# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The controls that save what a page shows as a file: one picture, or a film."""

from collections.abc import Callable
from typing import Any, Final

from .control_events import Apply

_RECORD: Final = 'record a GIF'


class PicturesPanel:
    """The buttons for a picture and a film on one page."""

    def __init__(self, gui: Any, save_picture: Callable[[], None],
                 record: Callable[[float], None], apply: Apply) -> None:
        """
        Make the controls.

        :param record: records a film of so many seconds, or ends the one that is recorded.
        """
        gui.add_button('save this picture').on_click(lambda _: apply(save_picture))
        self._seconds = gui.add_number(
            'length [s]', 5.0, min=0.1, max=600.0, step=0.5,
            hint='Recorded seconds of the GIF, from the moment that the page shows. The speed is '
            'that of the timeline.')
        self._record = gui.add_button(_RECORD)
        self._record.on_click(lambda _: apply(lambda: record(float(self._seconds.value))))

    def refresh(self, progress: tuple[int, int] | None) -> None:
        """
        Show how far a film is.

        :param progress: the pictures that exist and those that are needed; None: no film.
        """
        self._record.label = _RECORD if progress is None else 'stop ({} of {})'.format(*progress)
