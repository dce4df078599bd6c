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

"""Stamps out of a file that a person or a program has written: CSV, or TUM."""

from collections.abc import Iterator
from decimal import Decimal, InvalidOperation
from pathlib import Path
import re

import numpy as np
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, Stamps

from ..endings import Cannot

_BETWEEN = re.compile(r'[\s,;]+')
_COLUMN = 'stamp_ns'


def stamps_in(path: Path) -> Stamps:
    """
    Return the stamps in a file: of its column ``stamp_ns``, or of the first one.

    An integer is nanoseconds, a number with a point is seconds; both are taken exactly. Lines
    that begin with ``#`` are left out.

    :return: (N,) nanoseconds.
    :raises Cannot: the file cannot be read, or what stands there is no stamp.
    """
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else 'it is no text'
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
                         f'{column + 1}: integer nanoseconds, or seconds with a point') from None


def _is_number(text: str) -> bool:
    try:
        return Decimal(text).is_finite()
    except InvalidOperation:
        return False


def _stamp(text: str) -> int:
    return checked_stamp(round(Decimal(text) * NANOSECONDS_PER_SECOND) if '.' in text
                         else int(text))
