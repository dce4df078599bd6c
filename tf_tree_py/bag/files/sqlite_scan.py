# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reads truncated SQLite files: row by row, without their index."""

from collections.abc import Iterator
from pathlib import Path
import sqlite3

from rosbags.interfaces import MessageDefinition
from tf_tree_py.core.text import printable

from .message_source import MessageSource, RecordedMessage
from .rosbags_file import is_reliable, is_transient_local, is_volatile, profiles_of


class SqliteScan:
    """Reads one file; see ``Scan``."""

    def __init__(self, path: Path) -> None:
        """
        Open the file, and read no messages yet.

        :raises sqlite3.Error: it is not a database with topics.
        """
        self._database = sqlite3.connect(
            f'{path.resolve().as_uri()}?mode=ro&immutable=1', uri=True)
        # Otherwise SQLite opens no file that is shorter than its header declares.
        self._database.execute('PRAGMA writable_schema = ON')
        self._sources = {
            number: MessageSource(topic, kind, is_transient_local(profiles), '', False,
                                  is_reliable(profiles), is_volatile(profiles))
            for number, topic, kind, offered in self._database.execute(
                'SELECT id, name, type, offered_qos_profiles FROM topics')
            for profiles in [profiles_of(offered)]}
        self.definitions: dict[MessageSource, MessageDefinition] = {}
        self.lost = ''

    def __iter__(self) -> Iterator[RecordedMessage]:
        """Yield every message, in the order of the file."""
        self.lost = 'and nothing is missing'
        try:
            for topic, received, data in self._database.execute(
                    'SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id'):
                if topic not in self._sources:
                    raise sqlite3.DatabaseError('the row behind them is damaged')
                yield RecordedMessage(received, self._sources[topic], data)
        except sqlite3.Error as error:
            self.lost = f'and it is unknown how many are missing ({printable(str(error))})'
