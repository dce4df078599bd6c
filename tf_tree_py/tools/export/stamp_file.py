# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps from a file that a person or a program has written: CSV, or TUM."""

from collections.abc import Iterator
from decimal import Decimal, InvalidOperation
from pathlib import Path
import re

import numpy as np
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
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
