# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A record of finished bags on disk, so that a second run continues an interrupted one."""

import hashlib
import json
from pathlib import Path
import pickle

from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.whole_files import write_whole

from .bags import BagPath
from .jobs import failed, Job, LOST, Result, Row

_ROWS, _FILES = 'rows', 'bags'
_VERSION = 1


class Ledger:
    """
    A folder with a row for each bag that has been read, and its files.

    :ivar folder: its path.
    """

    def __init__(self, folder: Path, job: Job) -> None:
        """
        Open a folder, or make one.

        :param job: the job for the bags; rows of another job are ignored.
        :raises Cannot: it cannot be made.
        """
        self.folder = folder
        self._job = hashlib.sha256(pickle.dumps((_VERSION, type(job).__name__, job))).hexdigest()
        try:
            for name in (_ROWS, _FILES):
                Path(folder, name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Cannot(f'{folder} cannot be made: {error.strerror}') from error

    def finished(self, bag: BagPath) -> Row | None:
        """Return the row of a bag; None if it has to be read, for the first time or again."""
        try:
            entry = json.loads(self._row_of(bag).read_bytes())
            row: Row = entry['row']
            known = (entry['job'], entry['version']) == (self._job, bag.version)
            return row if known and row['outcome'] != LOST else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def keep(self, bag: BagPath, result: Result) -> Row:
        """Write the result for a bag, and return its row, which reports a failed write, too."""
        row = {'bag': bag.path, **result.row, 'file': ''}
        try:
            for suffix, data in result.files.items():
                name = f'{_FILES}/{bag.name}{suffix}'
                write_whole(self.folder / name, [data])
                row['file'] = row['file'] or name
            self._write(bag, row)
        except OSError as error:
            row = {'bag': bag.path, **failed(LOST, f'cannot be written: {error.strerror}').row,
                   'file': ''}
        return row

    def _write(self, bag: BagPath, row: Row) -> None:
        entry = {'job': self._job, 'version': bag.version, 'row': row}
        write_whole(self._row_of(bag), [json.dumps(entry).encode()])

    def _row_of(self, bag: BagPath) -> Path:
        return Path(self.folder, _ROWS, f'{bag.name}.json')
