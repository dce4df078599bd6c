# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files of a bag as their readers need them: not compressed, and with the rows of their log."""

from contextlib import closing
import os
from pathlib import Path
from shutil import copyfile
import sqlite3
from tempfile import TemporaryDirectory

from tf_tree_py.core.text import printable

from .discovery import LOG, PACKED
from .message_source import too_large, unpacked_limit
from .unpacking import zstd

_PIECE = 2**20


class PlainFile:
    """
    One file as it can be read; the recording itself may be read-only, and stays as it is.

    :ivar name: of the recording.
    :ivar path: of the recording, or of a copy in a temporary folder.
    :ivar fault: why it is not the whole recording; None: it is.
    """

    def __init__(self, recording: Path) -> None:
        """
        Make the copy, if one is necessary.

        :raises Exception: it cannot be decompressed.
        """
        self.name, self.path = recording.name, recording
        self.fault: Exception | None = None
        self._recording, self._folder = recording, None
        log = _log_of(recording)
        if log is None and recording.suffix != PACKED:
            return
        self._folder = TemporaryDirectory()
        if log is None:
            self.path = _unpacked_file(recording, Path(self._folder.name))
            return
        try:
            self.path = _with_log(recording, log, Path(self._folder.name))
        except (sqlite3.Error, OSError) as error:
            self.fault = ValueError(f'{error}; without {log.name}, which has the newest messages')

    def reason(self, error: object) -> str:
        """Return the text of an error on one line; it names the recording instead of the copy."""
        text = str(error).replace(str(self.path), str(self._recording)).rstrip('.')
        return printable(text) or type(error).__name__  # a MemoryError has no text

    def close(self) -> None:
        """Remove the copy."""
        if self._folder is not None:
            self._folder.cleanup()


def _log_of(path: Path) -> Path | None:
    """Return the write-ahead log that a killed recorder left beside a file of SQLite."""
    log = path.with_name(path.name + LOG)
    return log if path.suffix == '.db3' and log.is_file() and log.stat().st_size else None


def _with_log(path: Path, log: Path, folder: Path) -> Path:
    """
    Copy a file of SQLite into a folder, write the rows of its log into the copy, and return it.

    :raises sqlite3.Error: SQLite refuses the file.
    """
    copy = folder / path.name
    for file in (path, log):
        copyfile(file, folder / file.name)
    _remove_broken_page(copy)
    with closing(sqlite3.connect(copy)) as database:
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        database.execute('PRAGMA journal_mode = DELETE')
    return copy


def _remove_broken_page(copy: Path) -> None:
    """Shorten a truncated file to whole pages: SQLite would fill the last one with zeros."""
    with copy.open('rb') as file:
        size = int.from_bytes(file.read(18)[16:], 'big') or 1
    os.truncate(copy, copy.stat().st_size // size * size)


def _unpacked_file(path: Path, folder: Path) -> Path:
    """Decompress a file into a folder, and return it."""
    target = folder / path.stem
    size = path.stat().st_size
    left = unpacked_limit(size)
    with zstd.open(path) as packed, target.open('wb') as unpacked:
        while piece := packed.read(_PIECE):
            left -= len(piece)
            if left < 0:
                raise too_large('the file', size)
            unpacked.write(piece)
    return target
