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

"""The rows of all bags as one table, what is in trouble first."""

from collections.abc import Iterable, Sequence
import csv
import io
import json
from typing import Any

from .jobs import BROKEN, ERROR, FINE, LOST, Row, WARNING

VERSION = 1
"""Of the shape of the JSON; it changes only if a key goes or gets another meaning."""

WORST_FIRST = (LOST, BROKEN, ERROR, WARNING, FINE)


def by_trouble(rows: Iterable[Row]) -> list[Row]:
    """Return the rows, those of the worst outcome first, and of these what has most of it."""
    return sorted(rows, key=lambda row: (
        WORST_FIRST.index(row['outcome']),
        *(-row.get(key, 0) for key in ('errors', 'warnings', 'oddities', 'notes')), row['bag']))


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Return every key that a row has."""
    longest = max(rows, key=len, default={})
    return list(dict.fromkeys([*longest, *(key for row in rows for key in row)]))


def summary(rows: Sequence[Row]) -> dict[str, int]:
    """Return how many rows have which outcome, the worst first."""
    counts = {outcome: sum(row['outcome'] == outcome for row in rows) for outcome in WORST_FIRST}
    return {outcome: count for outcome, count in counts.items() if count}


def as_data(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the table as JSON has it."""
    return {'version': VERSION, 'bags': len(rows), 'outcomes': summary(rows), 'rows': list(rows)}


def as_json(rows: Sequence[Row]) -> bytes:
    """Return the table as JSON."""
    return json.dumps(as_data(rows), indent=2, allow_nan=False).encode()


def as_csv(rows: Sequence[Row]) -> bytes:
    """Return the table as CSV: a line for each bag."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns_of(rows), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode(errors='surrogateescape')
