# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The pages of a file of SQLite, one by one, also of a file that SQLite refuses.

The format: https://sqlite.org/fileformat2.html. A table is a tree of pages: inner pages name their
children, leaves hold cells, and a cell is a row id and a record. A record that is too long for its
page goes on in a chain of other pages. Numbers are big-endian.

Nothing in a file is trusted. A page serves one purpose, so neither a tree nor a chain has a loop,
and reading all of them takes no more than reading the file.
"""

from collections.abc import Iterator
from pathlib import Path
import struct
from typing import NamedTuple

from .scanning import mapped
from .sqlite_log import log_of, logged_pages, page_size

_MAGIC = b'SQLite format 3\0'
_HEADER = 100
"""The bytes of the file's header, at the begin of the first page."""

_INNER, _LEAF = 5, 13
_ENCODINGS = {2: 'utf-16-le', 3: 'utf-16-be'}

# More than any row id, which has 64 bits and a sign.
LOWEST, HIGHEST = -2**64, 2**64

_WIDTHS = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0)
"""The bytes of a value of each serial type: NULL, six integers, a float, the integers 0 and 1."""
_NULL, _FLOAT, _ZERO, _ONE, _BLOB, _TEXT = 0, 7, 8, 9, 12, 13

Value = int | float | bytes | str | None


class Damaged(ValueError):
    """A page, a cell or a record contradicts the format."""


class Cell(NamedTuple):
    """
    One row of a table.

    :ivar size: of its record, bytes.
    :ivar begin: of the record, as far as it is on the page of the cell.
    :ivar chain: the number of the page where it goes on; 0: nowhere.
    """

    row: int
    size: int
    begin: memoryview
    chain: int


class Branch(NamedTuple):
    """
    A leaf of a table, or a page that should lead to leaves and does not.

    :ivar page: its number; 0: no leaf.
    :ivar low: its row ids are greater.
    :ivar high: its highest possible row id; ``HIGHEST``: unknown.
    """

    page: int
    low: int
    high: int


class Pages:
    """
    All pages of one file; their numbers begin with 1, and the last one may end too soon.

    Those in the file's log replace them.

    :ivar damaged_log: the name of a log that is damaged; '': there is none.
    """

    def __init__(self, path: Path) -> None:
        """
        Open the file, and read its header.

        :raises ValueError: it is not a file of SQLite, or its header is damaged.
        """
        self._data = mapped(path, _MAGIC, 'SQLite')
        if len(self._data) < _HEADER:
            raise Damaged('it ends within its header')
        self.size = page_size(self._data)
        self._usable = self.size - self._data[20]
        if self.size < 512 or self.size & (self.size - 1) or self._usable < 480:
            raise Damaged('its pages have an impossible size')
        (encoding,) = struct.unpack_from('>I', self._data, 56)
        self.encoding = _ENCODINGS.get(encoding, 'utf-8')
        self._logged, self.damaged_log = self._read_log(path)
        self._count = -(-len(self._data) // self.size)
        self._claimed: set[int] = set()

    def _read_log(self, path: Path) -> tuple[dict[int, memoryview], str]:
        log = log_of(path)
        if log is None:
            return {}, ''
        pages, is_damaged = logged_pages(log, self.size)
        return pages, log.name if is_damaged else ''

    @property
    def most_rows(self) -> int:
        """Return a number that no row id exceeds, unless it is damaged: a row has some bytes."""
        (declared,) = struct.unpack_from('>I', self._data, 28)
        return max(int(declared), self._count + len(self._logged)) * self.size

    def stray_leaves(self) -> Iterator[int]:
        """Yield the numbers of the leaves that were not read as parts of a tree or a chain."""
        for number in sorted({*range(1, self._count + 1), *self._logged}):
            page_type = self._there(number)[_header_of(number):][:1]
            if page_type == bytes([_LEAF]) and number not in self._claimed:
                yield number

    def _there(self, number: int) -> memoryview:
        """Return what is there of a page."""
        begin = (number - 1) * self.size
        return self._logged.get(number) or self._data[max(begin, 0):max(begin + self.size, 0)]

    def _page(self, number: int) -> memoryview:
        page = self._there(number)
        if number < 1 or len(page) < _HEADER + 12:
            raise Damaged('a page is missing')
        return page

    def claim(self, number: int) -> int:
        """
        Return the type of a page of a tree, and let nothing else use it.

        :raises Damaged: it is missing, or in use.
        """
        page = self._page(number)
        if number in self._claimed:
            raise Damaged('two pages name the same one')
        self._claimed.add(number)
        return page[_header_of(number)]

    def branches(self, root: int) -> Iterator[Branch]:
        """
        Yield the leaves of a table, and its holes, in the order of their row ids.

        :param root: the number of its first page.
        """
        left = [Branch(root, LOWEST, HIGHEST)]
        while left:
            branch = left.pop()
            try:
                page_type = self.claim(branch.page)
                if page_type == _LEAF:
                    self._pointers(branch.page, 8)
                    yield branch
                elif page_type == _INNER:
                    left += reversed(self._children(branch))
                else:
                    raise Damaged('it is no page of a table')
            except Damaged:
                yield branch._replace(page=0)

    def _children(self, branch: Branch) -> list[Branch]:
        page, low, children = self._page(branch.page), branch.low, []
        for pointer in self._pointers(branch.page, 12):
            try:
                (child,) = struct.unpack_from('>I', page, pointer)
            except struct.error:
                raise Damaged('a cell is not on its page') from None
            high, _ = _varint(page, pointer + 4)
            if not low < high < branch.high:
                raise Damaged('the row ids of a page are in no order')
            children.append(Branch(child, low, high))
            low = high
        (last,) = struct.unpack_from('>I', page, _header_of(branch.page) + 8)
        return [*children, Branch(last, low, branch.high)]

    def _pointers(self, number: int, header: int) -> tuple[int, ...]:
        """Return the places of the cells of a page whose header has so many bytes."""
        page, begin = self._page(number), _header_of(number)
        (count,) = struct.unpack_from('>H', page, begin + 3)
        if begin + header + 2 * count > len(page):
            raise Damaged('a page has more cells than it can hold')
        return struct.unpack_from(f'>{count}H', page, begin + header)

    def cells(self, number: int) -> Iterator[tuple[int, Cell | None]]:
        """
        Yield the cells of a leaf, and where in the file they begin; None for a damaged one.

        :raises Damaged: the leaf is damaged.
        """
        begin, room = (number - 1) * self.size, self.size
        for pointer in self._pointers(number, 8):
            try:
                cell = self.cell(begin + pointer)
                room -= len(cell.begin)
            except Damaged:
                yield begin + pointer, None
            else:
                # Cells that lie on each other could be more than the file has.
                yield begin + pointer, cell if room >= 0 else None

    def cell(self, place: int) -> Cell:
        """
        Return the cell that begins at a place in the file.

        :raises Damaged: there is none.
        """
        number, begin = divmod(place, self.size)
        page = self._page(number + 1)
        size, begin = _varint(page, begin)
        row, begin = _varint(page, begin)
        share = self._share(size)
        end = begin + share
        chain = page[end:end + 4] if share < size else b''
        if end + len(chain) > len(page):
            raise Damaged('a cell is not on its page')
        return Cell(row, size, page[begin:end], int.from_bytes(chain, 'big'))

    def _share(self, size: int) -> int:
        """Return how many bytes of a record are on the page of its cell."""
        most = self._usable - 35
        if size <= most:
            return size
        least = (self._usable - 12) * 32 // 255 - 23
        share = least + (size - least) % (self._usable - 4)
        return share if share <= most else least

    def claim_chain(self, cell: Cell) -> None:
        """
        Check that the whole record of a cell is there, and let nothing else use its pages.

        :raises Damaged: a page is missing, or in use, or it is not the last one.
        """
        number = cell.chain
        for begin in range(len(cell.begin), cell.size, self._usable - 4):
            self.claim(number)
            page = self._page(number)
            if len(page) - 4 < min(cell.size - begin, self._usable - 4):
                raise Damaged('a page ends too soon')
            number = int.from_bytes(page[:4], 'big')
        if cell.chain and number:
            raise Damaged('a chain of pages does not end where its record does')

    def record(self, cell: Cell) -> memoryview:
        """
        Return the whole record of a cell; ``claim_chain`` checked it.

        :raises Damaged: a page is missing.
        """
        if not cell.chain:
            return cell.begin
        parts, number = [cell.begin], cell.chain
        for _ in range(len(cell.begin), cell.size, self._usable - 4):
            page = self._page(number)
            number = int.from_bytes(page[:4], 'big')
            parts.append(page[4:self._usable])
        return memoryview(b''.join(parts))[:cell.size]


class Field(NamedTuple):
    """One value of a record: its type, and where in the record it begins, and its bytes."""

    serial_type: int
    begin: int
    size: int

    def is_number(self) -> bool:
        """Return whether it is an integer."""
        return _NULL < self.serial_type < _FLOAT or self.serial_type in (_ZERO, _ONE)

    def is_blob(self) -> bool:
        """Return whether it is bytes."""
        return self.serial_type >= _BLOB and self.serial_type % 2 == 0

    def is_text(self) -> bool:
        """Return whether it is text."""
        return self.serial_type >= _TEXT and self.serial_type % 2 == 1

    def value(self, record: memoryview, encoding: str) -> Value:
        """
        Return it.

        :param record: its bytes, or the first of them.
        :param encoding: of the texts in the file.
        :raises Damaged: the value is behind those bytes.
        """
        data = record[self.begin:self.begin + self.size]
        if len(data) < self.size:
            raise Damaged('a value is not on the page of its cell')
        if self.is_blob():
            return bytes(data)
        if self.is_text():
            return bytes(data).decode(encoding, 'replace')
        if self.serial_type == _FLOAT:
            return float(struct.unpack('>d', data)[0])
        if self.serial_type in (_ZERO, _ONE):
            return self.serial_type - _ZERO
        return int.from_bytes(data, 'big', signed=True) if self.serial_type else None


def fields_of(cell: Cell) -> list[Field]:
    """
    Return the values of a record; its header on the page of the cell says where they are.

    :raises Damaged: they do not fill the record, or the header goes on elsewhere.
    """
    end, place = _varint(cell.begin, 0)
    begin, fields = end, []
    while place < end:
        serial_type, place = _varint(cell.begin, place)
        if serial_type < 0 or serial_type in (10, 11):
            raise Damaged('a value has no serial type')
        size = _WIDTHS[serial_type] if serial_type < _BLOB else (serial_type - _BLOB) // 2
        fields.append(Field(serial_type, begin, size))
        begin += size
    if place != end or begin != cell.size:
        raise Damaged('the values of a record do not fill it')
    return fields


def _header_of(number: int) -> int:
    """Return where on a page its own header begins."""
    return _HEADER if number == 1 else 0


def _varint(data: memoryview, place: int) -> tuple[int, int]:
    """
    Return an integer of 1 to 9 bytes, and the place behind it.

    :raises Damaged: it goes on behind the data.
    """
    value = 0
    try:
        for end in range(place + 1, place + 9):
            byte = data[end - 1]
            value = value << 7 | byte & 127
            if byte < 128:
                return value, end
        value = value << 8 | data[place + 8]
    except IndexError:
        raise Damaged('a number is not on its page') from None
    return value - 2**64 if value >= 2**63 else value, place + 9
