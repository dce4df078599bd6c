# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The lookup audit: which line of code looked up which time, and the resulting error.

A lookup of the latest transform, or of a stamp that was taken too late, returns a valid pose
of the wrong moment without an error. An audit observes a buffer's lookups. For each calling
line it compares the stamps with the newest data and with the current time, and measures how
far the source moved in the target in between: in centimetres and degrees. ``watch`` audits an
unchanged program, and writes a file to a folder when the program ends.
"""

import atexit
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import asdict, dataclass
from itertools import count
import json
import math
import os
from pathlib import Path, PurePath
import sys
import time
from typing import NamedTuple

from tf_tree_py.beyond.freshness.queries import FreshQueries
from tf_tree_py.core import fork_locks
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.observers import AUDIT_FOLDER, End, Observer
from tf_tree_py.core.stamp import from_seconds, LATEST, UNLIMITED
from tf_tree_py.core.text import shorten
from tf_tree_py.files.whole_files import write_whole

from .plain_text import as_lines

_ASSUMED_AGE = from_seconds(0.1)
"""The assumed age of data whose pose was looked up with ``LATEST``, if it is not known."""

# The maximum number of lines; a program has fewer, unless it invents frames.
MAX_LINES = 1_000
# A frame's name is cut to this length: any client may request any name from a buffer server.
_LONGEST_NAME = 200
_PACKAGE = __name__.partition('.')[0]
_data_stamp: ContextVar[int | None] = ContextVar('data_stamp', default=None)
# The executables of this package call lookups themselves; its other layers do it for a caller.
_EXECUTABLES = {'nodes', 'tools', 'view', 'labs'}


class Caller(NamedTuple):
    """A line of code."""

    file: str
    line: int
    function: str

    def __str__(self) -> str:
        return f'{"/".join(PurePath(self.file).parts[-2:])}:{self.line} {self.function}'


class Lookup(NamedTuple):
    """
    One lookup, as the audit records it.

    :ivar asked: the requested stamp; None: the latest.
    :ivar newest: the latest common time of the two frames; ``LATEST``: all edges are static.
    :ivar now: the time of the lookup.
    :ivar pose: ``target_T_source`` as returned; None if the lookup raised an error.
    :ivar other_stamp: the stamp to compare with: that of the data if it is known; otherwise
        the newest, or for a lookup of the latest ``_ASSUMED_AGE`` before it.
    :ivar other_pose: ``target_T_source`` at that stamp; None if it is not available.
    :ivar stamp_known: whether the stamp of the data is known; see ``LookupAudit.data_of``.
    """

    caller: Caller
    target: str
    source: str
    asked: int | None
    newest: int
    now: int
    pose: PoseTuple | None
    other_stamp: int
    other_pose: PoseTuple | None
    stamp_known: bool = False


@dataclass
class Line:
    """
    The lookups of one line of code, for one pair of frames, of one type.

    Times are seconds: the mean of all lookups that returned a pose and were compared. Distances
    are metres and radians: the maximum of all lookups of how far the source moved in the target
    between the returned pose and the pose compared with. See ``meaning``.

    :ivar latest: whether it looked up the latest, and not a stamp.
    :ivar stamp_known: whether the stamp of the data is known; see ``LookupAudit.data_of``.
    :ivar behind_newest_s: from the stamp of the answer to the newest data.
    :ivar behind_now_s: from the stamp of the answer to the time of the lookup.
    :ivar apart_s: from the stamp of the answer to the stamp compared with.
    :ivar moved_m: the distance.
    :ivar turned_rad: the angle.
    """

    caller: Caller
    target: str
    source: str
    latest: bool
    stamp_known: bool
    lookups: int = 0
    failed: int = 0
    compared: int = 0
    behind_newest_s: float = 0.0
    behind_now_s: float = 0.0
    apart_s: float = 0.0
    moved_m: float = 0.0
    turned_rad: float = 0.0

    @property
    def meaning(self) -> str:
        """Return the meaning of the distance, in words."""
        if self.stamp_known:
            return 'that is what it cost'
        return 'that is what 100 ms cost' if self.latest else 'the latest would have cost that'

    def add(self, lookup: Lookup) -> None:
        """Count one more."""
        self.lookups += 1
        if lookup.pose is None:
            self.failed += 1
            return
        if lookup.newest == LATEST or lookup.other_pose is None:
            return
        self.compared += 1
        stamp = lookup.newest if lookup.asked is None else lookup.asked
        for name, span in (('behind_newest_s', lookup.newest - stamp),
                           ('behind_now_s', lookup.now - stamp),
                           ('apart_s', abs(stamp - lookup.other_stamp))):
            mean = getattr(self, name)
            setattr(self, name, mean + (span / 1e9 - mean) / self.compared)
        moved, turned = se3.distance(lookup.pose, lookup.other_pose)
        self.moved_m = max(self.moved_m, moved)
        self.turned_rad = max(self.turned_rad, turned)


class LookupAudit(Observer):
    """
    An audit of a buffer's lookups, by calling line of code.

    It is one of the buffer's ``observers``. All methods are thread-safe. An observed lookup
    causes two more lookups, and takes about ten microseconds longer.
    """

    def __init__(self, buffer: FreshQueries, now: Callable[[], int] = time.time_ns) -> None:
        """
        Make an empty audit; ``buffer.observers.add`` starts it.

        :param buffer: where poses at other times are looked up.
        :param now: the clock, nanoseconds.
        """
        self._buffer = buffer
        self._now = now
        self._lock = fork_locks.lock()
        self._lines: dict[tuple[object, ...], Line] = {}

    # --- feeding

    def asked(self, target: str, source: str, stamp: int | None) -> End:
        """Receive a lookup that begins; return the function to call when it has ended."""
        begun = _caller(), str(target), str(source), stamp, _data_stamp.get()
        return lambda error: self._ended(*begun, answered=error is None)

    @contextmanager
    def data_of(self, stamp: int) -> Iterator[None]:
        """
        Set the stamp of the data that the code in the context processes, nanoseconds.

        A lookup there with another stamp is compared with this one, not with an assumption.
        """
        token = _data_stamp.set(stamp)
        try:
            yield
        finally:
            _data_stamp.reset(token)

    def record(self, lookup: Lookup) -> None:
        """Count one lookup."""
        latest = lookup.asked is None
        target, source = (shorten(name, _LONGEST_NAME) for name in (lookup.target, lookup.source))
        key = (lookup.caller, target, source, latest, lookup.stamp_known)
        with self._lock:
            line = self._lines.get(key)
            if line is None:
                if len(self._lines) >= MAX_LINES:
                    return
                line = self._lines[key] = Line(*key)
            line.add(lookup)

    def _ended(self, caller: Caller, target: str, source: str, asked: int | None,
               data_stamp: int | None, answered: bool) -> None:
        now = self._now()
        newest, at_newest = LATEST, None
        with suppress(TransformException):
            newest, at_newest = self._buffer.lookup_no_older(target, source, LATEST, UNLIMITED)
        pose, other_stamp, other = None, newest, at_newest
        if answered:
            pose = at_newest if asked is None else self._pose(target, source, asked)
            if data_stamp is not None:
                other_stamp = data_stamp
            elif asked is None:
                other_stamp = newest - _ASSUMED_AGE
            if other_stamp != newest:
                other = self._pose(target, source, other_stamp)
        self.record(Lookup(caller, target, source, asked, newest, now, pose, other_stamp, other,
                           data_stamp is not None))

    def _pose(self, target: str, source: str, stamp: int) -> PoseTuple | None:
        with suppress(TransformException):
            return self._buffer.lookup_at(target, source, stamp)
        return None

    # --- reading

    def lines(self) -> list[Line]:
        """Return copies of all lines: possible mistakes first, the largest errors on top."""
        with self._lock:
            lines = [Line(**vars(line)) for line in self._lines.values()]
        return _worst_first(lines)

    def clear(self) -> None:
        """Forget all lines."""
        with self._lock:
            self._lines.clear()

    def as_text(self) -> str:
        """Return a table for a terminal."""
        return '\n'.join(as_lines([_HEADINGS, *map(_cells, self.lines())], _NUMBERS))

    def as_json(self) -> str:
        """Return a list of all lines, as JSON: SI units."""
        return json.dumps([
            {**asdict(line), 'caller': line.caller._asdict(), 'meaning': line.meaning}
            for line in self.lines()], indent=2)


def _worst_first(lines: Iterable[Line]) -> list[Line]:
    """Return lines in order: possible mistakes first, the largest errors on top."""
    return sorted(lines, key=lambda line: (
        not (line.latest or line.stamp_known), -line.moved_m, line.caller, line.target))


def lines_of(text: str) -> list[Line]:
    """Return the lines that ``as_json`` wrote."""
    return [Line(**{**found, 'caller': Caller(**found['caller'])}) for found in (
        {name: value for name, value in line.items() if name != 'meaning'}
        for line in json.loads(text))]


_HEADINGS = ('line', 'target <- source', 'asked for', 'times', 'failed', 'behind newest [ms]',
             'behind now [ms]', 'apart [ms]', 'moved at most [cm]', 'turned [deg]', '')
_NUMBERS = range(3, 10)


def _cells(line: Line) -> tuple[str, ...]:
    found = [f'{line.behind_newest_s * 1e3:.1f}', f'{line.behind_now_s * 1e3:.1f}',
             f'{line.apart_s * 1e3:.1f}', f'{line.moved_m * 100.0:.2f}',
             f'{math.degrees(line.turned_rad):.2f}', line.meaning]
    return (str(line.caller), f'{line.target} <- {line.source}',
            'latest' if line.latest else 'a stamp', str(line.lookups), str(line.failed),
            *(found if line.compared else ['-'] * 5 + ['']))


def _caller() -> Caller:
    """Return the line that called this library."""
    frame = sys._getframe(1)
    while frame.f_back is not None and _is_library(frame.f_globals.get('__name__', '')):
        frame = frame.f_back
    return Caller(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name)


def _is_library(module: str) -> bool:
    package, *inside = module.split('.')
    return package == _PACKAGE and _EXECUTABLES.isdisjoint(inside[:1])


# --- the audit of an unchanged program

_numbers = count()


def watch(buffer: FreshQueries) -> None:
    """Audit a buffer's lookups until the process ends, then write the audit to the folder."""
    audit = LookupAudit(buffer, getattr(buffer, 'now', time.time_ns))
    buffer.observers.add(audit)
    path = Path(os.environ[AUDIT_FOLDER], f'{os.getpid()}-{next(_numbers)}.json')
    atexit.register(lambda: write_whole(path, [audit.as_json().encode()]))


def read(folder: Path) -> list[Line] | None:
    """Return the lines of all programs, the worst first; None if no buffer was made."""
    files = list(folder.glob('*.json'))
    return _worst_first(line for file in files for line in lines_of(file.read_text())
                        ) if files else None
