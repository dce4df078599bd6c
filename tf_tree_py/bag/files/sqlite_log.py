# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The write-ahead log of SQLite, read without SQLite.

The format: https://sqlite.org/fileformat2.html#walformat. Frames follow a header, and each has a
page of the file. Numbers are big-endian, except for the sums, which are those of a little-endian
machine.

SQLite writes a log into its file, also if the file is truncated. Then it refuses the log because
it is too short for the hole, or fills the hole with zeros, which later pass for data.
"""

from pathlib import Path
import struct
from typing import NamedTuple

from .discovery import LOG
from .scanning import mapped

_MAGIC = b'\x37\x7f\x06\x82'
_HEADER = struct.Struct('>8I')
_FRAME = struct.Struct('>6I')


def log_of(path: Path) -> Path | None:
    """Return the write-ahead log that a killed recorder left beside a file of SQLite."""
    log = path.with_name(path.name + LOG)
    return log if path.suffix == '.db3' and log.is_file() and log.stat().st_size else None


def page_size(header: bytes | memoryview) -> int:
    """Return the size of the pages of a file, from its header: 65536 does not fit, and is 1."""
    size = int.from_bytes(header[16:18], 'big')
    return 2**16 if size == 1 else size


def check_for_sqlite(path: Path, log: Path) -> None:
    """
    Check that SQLite can write a log into its file without damage.

    :raises ValueError: the file has fewer pages than its header says, or the log is damaged.
    """
    with path.open('rb') as file:
        header = file.read(32)
    size = page_size(header)
    if path.stat().st_size < size * int.from_bytes(header[28:32], 'big'):
        raise ValueError('it is truncated')
    if size and logged_pages(log, size).is_damaged:  # an empty file has no size
        raise ValueError(f'{log.name} is damaged')


class LoggedPages(NamedTuple):
    """
    What a log has.

    :ivar pages: by their numbers; the newest of each, as far as transactions are complete.
    :ivar is_damaged: whether there is more behind them that cannot be read.
    """

    pages: dict[int, memoryview]
    is_damaged: bool


def logged_pages(path: Path, size: int) -> LoggedPages:
    """
    Return what a log has; SQLite does not mention that it is damaged.

    :param size: of a page.
    """
    try:
        log = mapped(path, _MAGIC, 'a log of SQLite')
        _, _, own_size, _, *salts, one, other = _HEADER.unpack_from(log)
    except (OSError, ValueError, struct.error):
        return LoggedPages({}, True)
    sums = _sums(log[:24], (0, 0))
    if sums != (one, other) or own_size != size:
        return LoggedPages({}, True)
    pages: dict[int, memoryview] = {}
    begun: dict[int, memoryview] = {}
    for begin in range(_HEADER.size, len(log) - _FRAME.size - size + 1, _FRAME.size + size):
        number, ends, *own_salts, one, other = _FRAME.unpack_from(log, begin)
        if own_salts != salts:
            continue  # it is of an earlier log in the same file
        page = log[begin + _FRAME.size:begin + _FRAME.size + size]
        sums = _sums(page, _sums(log[begin:begin + 8], sums))
        if sums != (one, other):
            return LoggedPages(pages, True)
        begun[number] = page
        if ends:
            pages |= begun
            begun.clear()
    return LoggedPages(pages, False)


def _sums(data: memoryview, sums: tuple[int, int]) -> tuple[int, int]:
    """Return the two sums after more data; ``sums``: those before it."""
    one, other = sums
    for first, second in struct.iter_unpack('<2I', data):
        one = one + first + other & 0xffffffff
        other = other + second + one & 0xffffffff
    return one, other
