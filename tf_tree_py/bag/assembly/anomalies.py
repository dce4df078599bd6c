# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The anomalies in a bag, summarized by reason and edge: reported once, not once a message."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.stamp import format_stamp, LATEST

# A longer text would not be read; ``oddities`` has the rest as data.
_MAX_LINES = 20


class BagWarning(UserWarning):
    """A bag has anomalies; one warning lists all of them."""


class Anomaly(NamedTuple):
    """
    All anomalies of one reason on one edge.

    :ivar reason: a few words, such as ``out of order``.
    :ivar parent: of the edge; '' for the anomaly of a file or a message.
    :ivar times: the number of samples, messages or files.
    :ivar first: their oldest stamp, nanoseconds; ``LATEST`` if there is none.
    :ivar last: the newest.
    :ivar detail: about the first of them, or the worst.
    """

    reason: str
    parent: str
    child: str
    times: int
    first: int
    last: int
    detail: str

    def __str__(self) -> str:
        edge = f' {self.parent!r} -> {self.child!r}' if self.child else ''
        when = '' if self.first == LATEST else f', at {format_stamp(self.first)} s'
        if self.first != self.last:
            when = f', from {format_stamp(self.first)} to {format_stamp(self.last)} s'
        times = f'{self.times} times' if self.times > 1 else 'once'
        return f'{self.reason}{edge}: {times}{when}: {self.detail}'


@dataclass
class _Sum:
    times: int
    first: int
    last: int
    detail: str


class Anomalies:
    """Summarizes anomalies while a bag is read."""

    def __init__(self) -> None:
        self._sums: dict[tuple[str, str, str], _Sum] = {}

    def note(self, reason: str, detail: str, edge: tuple[str, str] = ('', ''), *,
             times: int = 1, first: int = LATEST, last: int | None = None) -> None:
        """Add anomalies of one reason; the detail of the first is kept."""
        last = first if last is None else last
        known = self._sums.setdefault((reason, *edge), _Sum(0, first, last, detail))
        known.times += times
        known.first, known.last = min(known.first, first), max(known.last, last)

    def note_incidents(self, incidents: Iterable[Incident]) -> None:
        """Add the incidents that the tree returned."""
        for incident in incidents:
            self.note(incident.kind.value, incident.detail, (incident.parent, incident.child),
                      first=incident.stamp)

    def summed(self) -> tuple[Anomaly, ...]:
        """Return the anomalies, the most frequent first."""
        found = [Anomaly(*key, each.times, each.first, each.last, each.detail)
                 for key, each in self._sums.items()]
        return tuple(sorted(found, key=lambda oddity: -oddity.times))


def as_text(path: object, oddities: Sequence[Anomaly]) -> str:
    """Return the anomalies of a bag as text: one a line."""
    lines = [f'  {oddity}' for oddity in oddities[:_MAX_LINES]]
    more = len(oddities) - len(lines)
    if more:
        lines.append(f'  and {more} more, in the .oddities of the buffer')
    return '\n'.join([f'{path}: odd, but read:', *lines])
