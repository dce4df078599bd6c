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

"""What is odd in a bag, summed up by reason and edge: told once, not once a message."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.stamp import format_stamp, LATEST

# More lines than this are not read; the rest can be had as data.
_MAX_LINES = 20


class BagWarning(UserWarning):
    """Something in a bag is odd; one warning tells all of it."""


class Oddity(NamedTuple):
    """
    All oddities of one reason on one edge.

    :ivar reason: a few words, such as ``out of order``.
    :ivar parent: of the edge; '' where it is about a file or a message.
    :ivar times: how often: samples, messages or files.
    :ivar first: the oldest stamp of them, nanoseconds; ``LATEST`` where there is none.
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


class Oddities:
    """Sums up what is odd, as a bag is read."""

    def __init__(self) -> None:
        self._sums: dict[tuple[str, str, str], _Sum] = {}

    def note(self, reason: str, detail: str, edge: tuple[str, str] = ('', ''), *,
             times: int = 1, first: int = LATEST, last: int | None = None) -> None:
        """Add some of one reason; the detail of the first is kept."""
        last = first if last is None else last
        known = self._sums.setdefault((reason, *edge), _Sum(0, first, last, detail))
        known.times += times
        known.first, known.last = min(known.first, first), max(known.last, last)

    def note_incidents(self, incidents: Iterable[Incident]) -> None:
        """Add what the tree refused, or told."""
        for incident in incidents:
            self.note(incident.kind.value, incident.detail, (incident.parent, incident.child),
                      first=incident.stamp)

    def summed(self) -> tuple[Oddity, ...]:
        """Return them, those that happened most often first."""
        found = [Oddity(*key, each.times, each.first, each.last, each.detail)
                 for key, each in self._sums.items()]
        return tuple(sorted(found, key=lambda oddity: -oddity.times))


def as_text(path: object, oddities: Sequence[Oddity]) -> str:
    """Return what is odd in a bag as text: a line each."""
    lines = [f'  {oddity}' for oddity in oddities[:_MAX_LINES]]
    more = len(oddities) - len(lines)
    if more:
        lines.append(f'  and {more} more, in the .oddities of the buffer')
    return '\n'.join([f'{path}: odd, but read:', *lines])
