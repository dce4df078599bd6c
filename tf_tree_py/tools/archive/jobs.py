# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The jobs for one bag, in a process on any machine.

Bags are found on this machine or with fsspec, and remote ones are copied to be read. A record of
finished bags on disk lets a second run continue an interrupted one.
"""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import glob
import hashlib
import json
import os
from pathlib import Path
import pickle
import re
from tempfile import TemporaryDirectory
import time
from typing import Any, NamedTuple

from tf_tree_py.bag import BagError
from tf_tree_py.bag.files.discovery import INDEX, names_messages
from tf_tree_py.command.endings import Cannot, cannot_be, needs
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.files.whole_files import write_whole
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds

from .page import report_page
from ..doctor_report import judged
from ..export.formats import FORMATS
from ..export.plan import Plan
from ..recorded_tree import RecordedTree


class BagPath(NamedTuple):
    """
    The place of a bag.

    :ivar path: absolute, or a URL.
    :ivar version: a text that differs whenever the bag has changed; '' if it is unknown.
    """

    path: str
    version: str

    @property
    def name(self) -> str:
        """Return a unique name for files, which begins with the bag's own."""
        digest = hashlib.sha256(self.path.encode(errors='surrogateescape')).hexdigest()[:12]
        own = re.sub(r'[^\w.-]', '_', self.path.rstrip('/').rpartition('/')[2])[:80]
        return f'{own}-{digest}'


def bags_in(patterns: Sequence[str]) -> list[BagPath]:
    """
    Return the bags that match patterns, in order, each once.

    A path without ``*``, ``?`` and ``[`` is returned whether it exists or not. Matches that are
    not bags are left out; the splits of a bag count as one.

    :raises Cannot: nothing matches, or fsspec is needed and fails.
    """
    found = [bag for pattern in patterns
             for bag in (_remote if _is_remote(pattern) else _local)(pattern)]
    if not found:
        raise Cannot(f'no bag matches {" ".join(patterns)}')
    return list({bag.path: bag for bag in found}.values())


def _is_remote(path: str) -> bool:
    """Return whether fsspec has to open it."""
    return '://' in path or '::' in path


def _local(pattern: str) -> list[BagPath]:
    paths = [pattern]
    if glob.has_magic(pattern):
        paths = _bags_of(sorted(glob.glob(pattern, recursive=True)), os.path.isdir, os.path.exists)
    return [BagPath(path, _version(Path(path))) for path in map(os.path.abspath, paths)]


def _version(path: Path) -> str:
    try:
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        return ' '.join(f'{status.st_size}@{status.st_mtime_ns}'
                        for status in (file.stat() for file in files))
    except OSError:
        return ''


def _remote(pattern: str) -> list[BagPath]:
    system, path, behind = _system_of(pattern)
    try:
        paths = [path]
        if glob.has_magic(path):
            paths = _bags_of(sorted(system.glob(path)), system.isdir, system.exists)
        return [BagPath(system.unstrip_protocol(path) + behind, _remote_version(system, path))
                for path in paths]
    except Exception as error:  # noqa: B902 - each file system has its own errors
        raise Cannot(f'{pattern} cannot be listed: {type(error).__name__}: {error}') from error


def _system_of(url: str) -> tuple[Any, str, str]:
    """Return fsspec's file system for a URL, the path in it, and the chained outer URL."""
    try:
        system, path = needs('fsspec.core', 'fsspec').url_to_fs(url)
    except (ImportError, ValueError, OSError) as error:
        raise Cannot(f'{url} cannot be opened: {error}') from error
    _, chained, outer = url.partition('::')
    return system, path, chained + outer


def _remote_version(system: Any, path: str) -> str:
    try:
        return str(system.info(path).get('size', ''))
    except OSError:
        return ''


def _bags_of(paths: Sequence[str], is_folder: Callable[[str], bool],
             exists: Callable[[str], bool]) -> list[str]:
    """Return the bags among the matches: files, and folders as rosbag2 writes them."""
    bags = list[str]()
    for path in (path.rstrip('/') for path in paths):
        folder = path if is_folder(path) else path.rpartition('/')[0]
        if exists(f'{folder}/{INDEX}' if folder else INDEX):
            bags.append(folder or '.')
        elif folder != path and names_messages(path):
            bags.append(path)
    return list(dict.fromkeys(bags))


@contextmanager
def _local_copy(path: str) -> Iterator[Path]:
    """Yield the path of a bag on this machine; a copy is deleted afterwards."""
    if not _is_remote(path):
        yield Path(path)
        return
    system, inner, _ = _system_of(path)
    with TemporaryDirectory() as folder:
        copy = Path(folder, inner.rstrip('/').rpartition('/')[2])
        system.get(inner, str(copy), recursive=system.isdir(inner))
        yield copy


# --- jobs

FINE, WARNING, ERROR = 'fine', 'warning', 'error'
BROKEN = 'broken'
"""The bag yields no result, and another try would not help."""
LOST = 'lost'
"""The bag did not cause the failure, and another try may help."""

Row = dict[str, Any]


class Result(NamedTuple):
    """
    The result of a job for one bag.

    :ivar row: of the table; at least ``outcome`` and ``reason``.
    :ivar files: by their suffixes; the first is the one for people.
    """

    row: Row
    files: dict[str, bytes]


Job = Callable[[Path, str], Result]
"""Takes the path of a bag, and its name; it can be sent to another process, as a partial can."""


def reported(limits: Thresholds, path: Path, name: str) -> Result:
    """Return the doctor's report about a bag."""
    doctor = Doctor(limits, recorded=True)
    arguments = Namespace(bag=path, tf_topic=None, tf_static_topic=None)
    with RecordedTree(arguments, [doctor], limits.cache_time) as tree_input:
        tree_input.watch(None)
        report, findings = judged(tree_input, doctor)
    report['source'] = name
    codes = dict.fromkeys(finding.code for finding in findings)
    row = {
        'outcome': ERROR if report['errors'] else
        (WARNING if report['warnings'] or report['damage'] else FINE),
        'reason': '; '.join(report['damage']),
        **{key: report[key] for key in ('errors', 'warnings', 'notes')},
        'codes': ' '.join(codes),
        **{key: report[key] for key in ('transforms', 'frames', 'watched_s')},
    }
    return Result(row, {'.html': report_page(report),
                        '.json': json.dumps(report, indent=2, allow_nan=False).encode()})


def exported(plan: Plan, form: str, path: Path, _: str) -> Result:
    """Return the trajectory of a plan in a bag."""
    taken, recording = plan.of(path)
    row = {
        'outcome': WARNING if recording.oddities else FINE,
        'reason': '; '.join(map(str, recording.oddities[:3])),
        'poses': len(taken.stamps),
        'outside': taken.outside,
        'oddities': len(recording.oddities),
        'first_s': format_stamp(int(taken.stamps.min())),
        'last_s': format_stamp(int(taken.stamps.max())),
    }
    return Result(row, {f'.{form}': FORMATS[form](taken)})


def done(job: Job, path: str) -> Result:
    """Run a job on a bag; any error is reported in the row."""
    begin = time.monotonic()
    try:
        with _local_copy(path) as here:
            try:
                result = job(here, path)
            except (BagError, TransformException, Cannot) as error:
                result = failed(BROKEN, str(error).replace(str(here), path))
    except Exception as error:  # noqa: B902 - the other bags have to be read
        result = failed(LOST, f'{type(error).__name__}: {error}')
    result.row['took_s'] = round(time.monotonic() - begin, 3)
    return result


def failed(outcome: str, reason: str) -> Result:
    """Return the result for a bag without any files."""
    return Result({'outcome': outcome, 'reason': ' '.join(reason.split())}, {})


# --- the record of finished bags

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
        self._job = hashlib.sha256(pickle.dumps((_VERSION, job))).hexdigest()
        with cannot_be('made', folder):
            for name in (_ROWS, _FILES):
                Path(folder, name).mkdir(parents=True, exist_ok=True)

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
