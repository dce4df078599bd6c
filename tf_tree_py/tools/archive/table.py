# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rows of all bags as one table, the worst first."""

from collections.abc import Iterable, Sequence
import csv
import io
import json

from .jobs import BROKEN, ERROR, FINE, LOST, Row, WARNING

VERSION = 1
"""The version of the JSON; it changes only if a key is removed or gets another meaning."""

_WORST_FIRST = (LOST, BROKEN, ERROR, WARNING, FINE)


def by_trouble(rows: Iterable[Row]) -> list[Row]:
    """Return the rows by outcome, the worst first, and within one by the counts of problems."""
    return sorted(rows, key=lambda row: (
        _WORST_FIRST.index(row['outcome']),
        *(-row.get(key, 0) for key in ('errors', 'warnings', 'oddities', 'notes')), row['bag']))


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Return every key that a row has."""
    longest = max(rows, key=len, default={})
    return list(dict.fromkeys([*longest, *(key for row in rows for key in row)]))


def summary(rows: Sequence[Row]) -> dict[str, int]:
    """Return the number of rows by outcome, the worst first."""
    counts = {outcome: sum(row['outcome'] == outcome for row in rows) for outcome in _WORST_FIRST}
    return {outcome: count for outcome, count in counts.items() if count}


def as_data(rows: Sequence[Row]) -> dict[str, object]:
    """Return the table as data for JSON."""
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
