# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files of a bag as their readers need them: not compressed, and with the rows of their log."""

from contextlib import closing
from pathlib import Path
from shutil import copyfile
import sqlite3
from tempfile import TemporaryDirectory
from typing import BinaryIO

from tf_tree_py.core.text import printable

from .connections import TooLarge
from .discovery import PACKED
from .sqlite_log import check_for_sqlite, log_of
from .unpacking import Unpacker

_PIECE = 2**12


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

        :raises TooLarge: it unpacks to more than the limit.
        :raises OSError: there is no room for the copy.
        """
        self.name, self.path = recording.name, recording
        self.fault: Exception | None = None
        self._recording, self._folder = recording, None
        log = log_of(recording)
        if log is None and recording.suffix not in PACKED:
            return
        self._folder = TemporaryDirectory()
        try:
            if log is None:
                self._unpack(Path(self._folder.name) / recording.stem)
            else:
                self._add_log(log, Path(self._folder.name))
        except (OSError, TooLarge):
            self.close()
            raise

    def _add_log(self, log: Path, folder: Path) -> None:
        """Write the log into a copy, if SQLite can; a scan reads both as they are."""
        try:
            check_for_sqlite(self._recording, log)
            self.path = _with_log(self._recording, log, folder)
        except (sqlite3.Error, OSError, ValueError) as error:
            self.fault = error

    def _unpack(self, target: Path) -> None:
        """Write as much of the recording as can be unpacked into a file."""
        size, self.path = self._recording.stat().st_size, target
        with self._recording.open('rb') as packed, target.open('wb') as unpacked:
            unpacker = _unpack(packed, unpacked, size, size)
            if unpacker.error is not None:
                # A block that ends in the piece of the error is whole.
                unpacker = _unpack(packed, unpacked, size, packed.tell() - _PIECE)
        if not unpacker.whole:
            state = ('ends too soon' if unpacker.error is None else
                     f'is damaged, so its last messages may be wrong ({unpacker.error})')
            self.fault = ValueError(
                f'the compressed file {state}: {unpacker.used:,} of its {size:,} bytes unpack to '
                f'{target.stat().st_size:,}')

    def reason(self, error: object) -> str:
        """Return the text of an error on one line; it names the recording instead of the copy."""
        text = str(error).replace(str(self.path), str(self._recording)).rstrip('.')
        return printable(text) or type(error).__name__  # a MemoryError has no text

    def close(self) -> None:
        """Remove the copy."""
        if self._folder is not None:
            self._folder.cleanup()


def _with_log(path: Path, log: Path, folder: Path) -> Path:
    """
    Copy a file of SQLite into a folder, write the rows of its log into the copy, and return it.

    :raises sqlite3.Error: SQLite refuses the file.
    """
    copy = folder / path.name
    for file in (path, log):
        copyfile(file, folder / file.name)
    with closing(sqlite3.connect(copy)) as database:
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        database.execute('PRAGMA journal_mode = DELETE')
    return copy


def _unpack(packed: BinaryIO, unpacked: BinaryIO, size: int, fine: int) -> Unpacker:
    """
    Write as much as can be unpacked.

    :param size: of the packed file.
    :param fine: from this place in it on, unpack byte by byte.
    """
    unpacker = Unpacker('zstd', 'the file', size)
    packed.seek(0)
    unpacked.seek(0)
    while unpacker.error is None and (
            piece := packed.read(_PIECE if packed.tell() < fine else 1)):
        unpacked.write(unpacker.unpack(piece))
    return unpacker
