# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The content of an export from a bag: two frames, and the stamps.

The stamps may come from a file that a person or a program has written: CSV, or TUM.
"""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterator, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path
import re
from typing import NamedTuple
import warnings

import numpy as np
from tf_tree_py.bag import BagWarning, open_bag, Recording, stamps_of
from tf_tree_py.bag.assembly.lone_samples import LONE_STAMP
from tf_tree_py.beyond.motion.trajectory import (
    Outside,
    stamps_at_rate,
    stamps_of_slowest,
    Trajectory,
    trajectory,
)
from tf_tree_py.command.arguments import add_number
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.stamp import BEGINNING, FOREVER, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, Stamps

_BETWEEN = re.compile(r'[\s,;]+')
_COLUMN = 'stamp_ns'


def stamps_in(path: Path) -> Stamps:
    """
    Return the stamps in a file: from its column ``stamp_ns``, or from the first one.

    An integer is nanoseconds, a number with a decimal point is seconds; both are read exactly.
    Lines that begin with ``#`` are ignored.

    :return: (N,) nanoseconds.
    :raises Cannot: the file cannot be read, or contains an invalid stamp.
    """
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else 'it is not a text file'
        raise Cannot(f'{path} cannot be read: {reason}') from error
    stamps = list(_stamps(path, lines))
    if not stamps:
        raise Cannot(f'{path} has no stamps')
    return np.array(stamps, dtype=np.int64)


def _stamps(path: Path, lines: list[str]) -> Iterator[int]:
    column = None
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith('#'):
            continue
        cells = _BETWEEN.split(line.strip())
        if column is None:
            column = cells.index(_COLUMN) if _COLUMN in cells else 0
            if not _is_number(cells[column]):  # the header
                continue
        try:
            yield _stamp(cells[column])
        except (IndexError, ValueError, ArithmeticError, InvalidArgumentException):
            raise Cannot(f'{path}, line {number}: {line[:80]!r} has no stamp in column '
                         f'{column + 1}: give integer nanoseconds, or seconds with a '
                         'decimal point') from None


def _is_number(text: str) -> bool:
    try:
        return Decimal(text).is_finite()
    except InvalidOperation:
        return False


def _stamp(text: str) -> int:
    return checked_stamp(round(Decimal(text) * NANOSECONDS_PER_SECOND) if '.' in text
                         else int(text))


# --- the plan

class Plan(NamedTuple):
    """
    The content of an export from each bag; it can be sent to another process.

    :ivar at: a topic, whose headers supply the stamps; or None.
    :ivar at_stamps: the stamps, nanoseconds; or None.
    :ivar rate_hz: the rate of the stamps; or None. Without any of the three, the stamps are those
        of the slowest edge between the frames.
    :ivar start: earlier stamps are left out, nanoseconds; None: none are.
    :ivar stop: later stamps are left out; None: none are.
    :ivar topics: the topics of the transforms; None: all.
    """

    target_frame: str
    source_frame: str
    at: str | None
    at_stamps: Stamps | None
    rate_hz: float | None
    start: int | None
    stop: int | None
    twist: bool
    outside: Outside
    topics: Sequence[str] | None

    def of(self, path: Path) -> tuple[Trajectory, Recording]:
        """
        Return the trajectory in a bag, and the bag as a buffer.

        :raises BagError: it cannot be read, or does not have the topic.
        :raises TransformException: the frames do not exist, or no lookup succeeds.
        :raises Cannot: there is no stamp with a transform.
        """
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', BagWarning)  # the recording has all of them
            recording = open_bag(path, topics=self.topics)
        frames = self.target_frame, self.source_frame
        taken = trajectory(recording, *frames, self._stamps(recording), twist=self.twist,
                           outside=self.outside)
        if taken.outside == len(taken.stamps) or not len(taken.stamps):
            raise Cannot(f'none of {taken.outside} stamps has a transform between {frames[0]!r} '
                         f'and {frames[1]!r}')
        return taken, recording

    def _stamps(self, recording: Recording) -> Stamps:
        if self.at_stamps is not None:
            return self._between(self.at_stamps)
        if self.at is not None:
            return self._between(stamps_of(recording, self.at))
        frames = self.target_frame, self.source_frame
        if self.rate_hz is None:
            return stamps_of_slowest(recording, *frames, start=self.start, stop=self.stop)
        try:
            return stamps_at_rate(recording, *frames, self.rate_hz, start=self.start,
                                  stop=self.stop)
        except InvalidArgumentException as error:
            raise Cannot('; '.join([str(error), *_lone_stamps(recording, *frames)])) from error

    def _between(self, stamps: Stamps) -> Stamps:
        begin = BEGINNING if self.start is None else self.start
        end = FOREVER if self.stop is None else self.stop
        return stamps[(stamps >= begin) & (stamps <= end)]


def _lone_stamps(recording: Recording, target: str, source: str) -> list[str]:
    """Return the anomalies that make the edges between two frames very long."""
    edges = {(edge.parent, edge.child) for edge in recording.edges_between(target, source)}
    return [str(oddity) for oddity in recording.oddities
            if oddity.reason == LONE_STAMP and (oddity.parent, oddity.child) in edges]


def add_frames(parser: ArgumentParser) -> None:
    """Add the arguments that name the two frames."""
    parser.add_argument('target', metavar='TARGET', help='the frame to express the poses in')
    parser.add_argument('source', metavar='SOURCE', help='the frame whose poses are written')


def add_plan(parser: ArgumentParser) -> None:
    """Add the arguments for ``planned``."""
    stamps = parser.add_argument_group(
        'stamps', 'default: the stamps of the slowest edge between the frames'
    ).add_mutually_exclusive_group()
    stamps.add_argument('--at', metavar='TOPIC', help='the stamps in the headers of a topic')
    stamps.add_argument('--at-file', metavar='CSV', type=Path, help='the stamps in the first '
                        'column of a file: integer nanoseconds, or seconds with a decimal point')
    add_number(stamps, '--rate', None, 'how many stamps per second')
    for name, text in (('--from', 'earlier'), ('--to', 'later')):
        parser.add_argument(name, metavar='STAMP', type=_one_stamp, help=f'leave out {text} '
                            'stamps: integer nanoseconds, or seconds with a decimal point')
    parser.add_argument('--outside', choices=['skip', 'nan', 'fail'], default='skip',
                        help='how to treat stamps without a transform: leave them out '
                        '(default), write NaN, or fail')
    parser.add_argument('--twist', action='store_true', help='also write the velocities of '
                        "the source's origin, in the target's axes")
    parser.add_argument('--topic', metavar='TOPIC', action='append', dest='topics',
                        help='read only the transforms of this topic; may be repeated')


def planned(arguments: Namespace) -> Plan:
    """
    Return the plan of the arguments of ``add_frames`` and ``add_plan``.

    :raises Cannot: there are no stamps in the file.
    """
    at_stamps = None if arguments.at_file is None else stamps_in(arguments.at_file)
    # "from" is a keyword.
    return Plan(arguments.target, arguments.source, arguments.at, at_stamps, arguments.rate,
                getattr(arguments, 'from'), arguments.to, arguments.twist, arguments.outside,
                arguments.topics)


def _one_stamp(text: str) -> int:
    try:
        return _stamp(text)
    except (ValueError, ArithmeticError, InvalidArgumentException):
        raise ArgumentTypeError(f'{text!r} is not a stamp: give integer nanoseconds, or seconds '
                                'with a decimal point') from None
