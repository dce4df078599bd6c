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

"""What has been done is on disk at once, so that a second run goes on where one stopped."""

import hashlib
import json
from pathlib import Path
import pickle

from .bags import BagPath
from .jobs import failed, Job, LOST, Result, Row
from ..endings import Cannot
from ..output import write_file

_ROWS, _FILES = 'rows', 'bags'
_VERSION = 1


class Ledger:
    """
    A folder with a row for each bag that has been read, and its files.

    :ivar folder: where it is.
    """

    def __init__(self, folder: Path, job: Job) -> None:
        """
        Open a folder, or make one.

        :param job: what is done with the bags; rows of another job count for nothing.
        :raises Cannot: there is no place for it.
        """
        self.folder = folder
        self._job = hashlib.sha256(pickle.dumps((_VERSION, type(job).__name__, job))).hexdigest()
        try:
            for name in (_ROWS, _FILES):
                Path(folder, name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Cannot(f'{folder} cannot be made: {error.strerror}') from error

    def finished(self, bag: BagPath) -> Row | None:
        """Return the row of a bag; None if it is to be read, or to be read again."""
        try:
            entry = json.loads(self._row_of(bag).read_bytes())
            row: Row = entry['row']
            known = (entry['job'], entry['version']) == (self._job, bag.version)
            return row if known and row['outcome'] != LOST else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def keep(self, bag: BagPath, result: Result) -> Row:
        """Write what came of a bag, and return its row; a full disk stands in that row."""
        row = {'bag': bag.path, **result.row, 'file': ''}
        try:
            for suffix, data in result.files.items():
                name = f'{_FILES}/{bag.name}{suffix}'
                write_file(self.folder / name, data)
                row['file'] = row['file'] or name
            self._write(bag, row)
        except OSError as error:
            row = {'bag': bag.path, **failed(LOST, f'cannot be written: {error.strerror}').row,
                   'file': ''}
        return row

    def _write(self, bag: BagPath, row: Row) -> None:
        entry = {'job': self._job, 'version': bag.version, 'row': row}
        write_file(self._row_of(bag), json.dumps(entry).encode())

    def _row_of(self, bag: BagPath) -> Path:
        return Path(self.folder, _ROWS, f'{bag.name}.json')
