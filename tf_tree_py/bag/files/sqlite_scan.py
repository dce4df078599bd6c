# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads the messages of rosbag2 out of a damaged file of SQLite, from its pages.

SQLite reads a table through its tree, up to the first page that is damaged or missing. But each
leaf has whole rows. If a part of the tree is missing, all other leaves are searched for rows of
the missing ids.
"""

from array import array
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
import re
from typing import Any, NamedTuple

import numpy as np
from rosbags.interfaces import MessageDefinition

from .connections import Connection, RecordedMessage
from .rosbags_file import profiles_of, ros2_connection
from .scanning import NOTHING_MISSING, UNKNOWN_MISSING
from .sqlite_pages import Branch, Cell, Damaged, Field, fields_of, HIGHEST, Pages


class _Table(NamedTuple):
    """
    One table.

    :ivar root: the number of its first page; 0: unknown.
    :ivar columns: their names.
    """

    root: int
    columns: Sequence[str]

    def fields(self, cell: Cell) -> dict[str, Field]:
        """
        Return the values of a row by their columns; a column that was added later has none.

        :raises Damaged: the cell has no record.
        """
        return dict(zip(self.columns, fields_of(cell), strict=False))

    def row(self, pages: Pages, place: int) -> dict[str, Any]:
        """Return the row whose cell begins at a place in the file."""
        cell = pages.cell(place)
        record = pages.record(cell)
        return {name: field.value(record, pages.encoding)
                for name, field in self.fields(cell).items()} | {'id': cell.row}


_SCHEMA = _Table(1, ('type', 'name', 'tbl_name', 'rootpage', 'sql'))
"""The table in which SQLite describes all others."""

_USUAL = {'topics': _Table(0, ('id', 'name', 'type', 'serialization_format',
                               'offered_qos_profiles')),
          'messages': _Table(0, ('id', 'topic_id', 'timestamp', 'data'))}
"""The tables of rosbag2, for a file whose description of them is damaged."""


class SqliteScan:
    """Reads one file; see ``Scan``."""

    def __init__(self, path: Path) -> None:
        """
        Open the file, and find its rows.

        :raises ValueError: it is not a file of SQLite, or has no tables of rosbag2.
        """
        self._pages = Pages(path)
        tables = self._tables()
        self._connections = self._topics(tables['topics'])
        if not self._connections and not tables['topics'].root:
            raise ValueError('it has no topics')
        self._table = tables['messages']
        found = _Rows(self._pages, self._table.root, self._is_message)
        self._places = found.places
        self.definitions: dict[Connection, MessageDefinition] = {}
        self.lost = found.lost
        if self._pages.damaged_log:
            self.lost = f'{UNKNOWN_MISSING}, because {self._pages.damaged_log} is damaged'

    def __iter__(self) -> Iterator[RecordedMessage]:
        """Yield every message, in the order of the row ids."""
        for place in self._places.tolist():
            row = self._table.row(self._pages, place)
            connection = self._connections[row['topic_id']]
            yield RecordedMessage(row['timestamp'], connection, row['data'])

    def _tables(self) -> dict[str, _Table]:
        """Return the tables of rosbag2, as the file describes them."""
        tables = dict(_USUAL)
        for row in self._rows(_SCHEMA, name=Field.is_text, rootpage=Field.is_number,
                              sql=Field.is_text):
            if row['name'] in _USUAL:
                usual, columns = _USUAL[row['name']].columns, _columns(row['sql'])
                known = {*usual[:4]} <= {*columns}
                tables[row['name']] = _Table(row['rootpage'], columns if known else usual)
        return tables

    def _topics(self, table: _Table) -> dict[int, Connection]:
        connections = {}
        for row in self._rows(table, name=Field.is_text, type=Field.is_text):
            connections[row['id']] = ros2_connection(
                row['name'], row['type'], profiles_of(row.get('offered_qos_profiles') or ''))
        return connections

    def _rows(self, table: _Table, **types: Callable[[Field], bool]) -> Iterator[dict[str, Any]]:
        """Yield the rows of a small table; the values in some columns are of these types."""
        def is_row(cell: Cell) -> bool:
            fields = table.fields(cell)
            return all(name in fields and is_type(fields[name]) for name, is_type in types.items())

        for place in _Rows(self._pages, table.root, is_row).places.tolist():
            yield table.row(self._pages, place)

    def _is_message(self, cell: Cell) -> bool:
        """Return whether a cell is a message on a known topic; raises Damaged, too."""
        fields = self._table.fields(cell)
        topic, received, data = map(fields.get, ('topic_id', 'timestamp', 'data'))
        return (topic is not None and topic.is_number()
                and received is not None and received.is_number()
                and data is not None and data.is_blob()
                and topic.value(cell.begin, '') in self._connections)


class _Rows:
    """
    The rows of one table, as far as they are in the file.

    :ivar places: where in the file their cells begin, in the order of their row ids.
    :ivar lost: how many are missing, in words.
    """

    def __init__(self, pages: Pages, root: int, is_row: Callable[[Cell], bool]) -> None:
        """
        Find them.

        :param root: the number of the table's first page; 0: unknown.
        :param is_row: whether a cell looks like one of its rows; may raise Damaged.
        """
        self._pages, self._is_row = pages, is_row
        self._ids, self._places, self._highest = array('q'), array('q'), 0
        damaged, holes = 0, []
        for branch in pages.branches(root):
            if branch.page:
                damaged += self._read(branch.page, [branch])
            else:
                holes.append(branch)
        in_tree = len(self._ids)
        for number in pages.stray_leaves() if holes else ():
            with suppress(Damaged):
                self._read(number, holes)
        # The first one of each id: what the tree leads to is valid, others may be old copies.
        ids, first = np.unique(np.array(self._ids, np.int64), return_index=True)
        self.places = np.array(self._places, np.int64)[first]
        self.lost = self._words(holes, len(ids) - in_tree, damaged)

    def _read(self, number: int, ranges: Sequence[Branch]) -> int:
        """
        Keep the rows of a leaf whose ids are in one of the ranges.

        :return: the number of its other cells.
        :raises Damaged: it is no leaf.
        """
        others = 0
        for place, cell in self._pages.cells(number):
            try:
                if cell is None or not _covers(ranges, cell.row) or not self._is_row(cell):
                    raise Damaged('it is no row of this table')
                self._highest = max(self._highest, cell.row)
                self._pages.claim_chain(cell)
            except Damaged:
                others += 1
            else:
                self._ids.append(cell.row)
                self._places.append(place)
        return others

    def _words(self, holes: Sequence[Branch], found: int, damaged: int) -> str:
        """
        Return in words how many rows are missing: rosbag2 leaves out no id.

        :param found: the number of rows in the holes of the tree that other leaves had.
        :param damaged: the number of rows in the tree that cannot be read.
        """
        at_end = bool(holes) and holes[-1].high == HIGHEST
        highest = max([self._highest, *(hole.high for hole in holes if hole.high < HIGHEST)])
        expected = sum(max(0, min(hole.high, highest) - max(hole.low, 0)) for hole in holes)
        missing = damaged + max(0, expected - found)
        if not missing and not at_end:
            return NOTHING_MISSING
        if not 0 < missing <= self._pages.most_rows:
            return UNKNOWN_MISSING
        return (f'and {"at least " if at_end else ""}{missing:,} '
                f'{"is" if missing == 1 else "are"} missing')


def _covers(ranges: Sequence[Branch], row: int) -> bool:
    """Return whether a row id is in one of the ranges, which are in order."""
    index = bisect_left(ranges, row, key=lambda branch: branch.low) - 1
    return index >= 0 and row <= ranges[index].high


def _columns(sql: str) -> list[str]:
    """Return the names of the columns, from the text that created a table."""
    inside = sql.partition('(')[2].rpartition(')')[0]
    words = re.sub(r'\([^()]*\)', '', inside).split(',')  # without (10, 2) and the like
    return [(each.split() or [''])[0].strip('"`[]\'').lower() for each in words]
