# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""SQLite files that are cut off: row by row, without their index."""

from collections.abc import Iterator
from pathlib import Path
import sqlite3

from rosbags.interfaces import MessageDefinition
from rosbags.rosbag2.metadata import parse_qos

from .rosbags_file import is_reliable, is_transient_local, is_volatile
from .source import Arrival, Source


class SqliteScan:
    """Reads one file; see ``Scan``."""

    def __init__(self, path: Path) -> None:
        """
        Begin with nothing read.

        :raises sqlite3.Error: it is no database with topics.
        """
        self._database = sqlite3.connect(
            f'{path.resolve().as_uri()}?mode=ro&immutable=1', uri=True)
        # Otherwise SQLite opens no file that is shorter than it says.
        self._database.execute('PRAGMA writable_schema = ON')
        self._sources = {
            number: Source(topic, kind, is_transient_local(profiles), '', False,
                           is_reliable(profiles), is_volatile(profiles))
            for number, topic, kind, offered in self._database.execute(
                'SELECT id, name, type, offered_qos_profiles FROM topics')
            for profiles in [parse_qos(offered)]}
        self.definitions: dict[Source, MessageDefinition] = {}
        self.lost = ''

    def __iter__(self) -> Iterator[Arrival]:
        """Yield every message, in the order in which they stand in the file."""
        self.lost = 'and nothing is missing'
        try:
            for topic, received, data in self._database.execute(
                    'SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id'):
                if topic not in self._sources:
                    raise sqlite3.DatabaseError('the row behind them is damaged')
                yield Arrival(received, self._sources[topic], data)
        except sqlite3.Error as error:
            self.lost = f'and how many are missing nobody knows ({error})'
