# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A log that a flood of bad data cannot fill.

It has at most a line a second for each kind and each sender, and the counts of the others. All
lines that a sender of data can cause are written through it.

rclpy's ``throttle_duration_sec`` does not suffice: it limits a line of the source code, so kinds
and senders hide each other, and it does not count what it leaves out.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
import sys
import time
import traceback
from typing import Protocol

from tf_tree_py.core import fork_locks
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.text import printable, shorten

# The time between two lines of one kind and sender, seconds; and the time in which a line about
# the same subject is not repeated.
_APART_S, _PERIOD_S = 1.0, 10.0
# So many senders are counted separately for each kind. A sender may invent any number of names.
_MOST_SENDERS = 10
# How many subjects a count names, and the most characters of each.
_MOST_EXAMPLES, _LONGEST = 5, 80
# The most characters of a line, or of a traceback, which may contain a sender's text.
_LONGEST_LINE = 10_000


@dataclass
class _Flow:
    """
    The messages of one kind from one sender.

    :ivar line_at: when its last line was written.
    :ivar count_at: the earliest time of a line with nothing but a count.
    :ivar last: when its last message was not written.
    :ivar shown: until when each subject is not repeated.
    :ivar omitted: how many messages were not written since the last line.
    :ivar examples: subjects of these.
    """

    line_at: float
    count_at: float = 0.0
    last: float = 0.0
    shown: dict[str, float] = field(default_factory=dict)
    omitted: int = 0
    examples: list[str] = field(default_factory=list)

    def admits(self, about: str | None, now: float) -> bool:
        """Return whether to write a message now; otherwise count it."""
        if now >= self.line_at + _APART_S:
            self.shown = {other: until for other, until in self.shown.items() if now < until}
            if about not in self.shown:
                if about is not None:
                    self.shown[about] = now + _PERIOD_S
                return True
        self.omitted += 1
        self.last = now
        if about and len(self.examples) < _MOST_EXAMPLES and about not in self.examples:
            self.examples.append(about)
        return False

    def owes_count(self, now: float) -> bool:
        """Return whether a flood has ended, and its count was not written yet."""
        return bool(self.omitted) and now >= max(
            self.count_at, max(self.line_at, self.last) + _APART_S)

    def has_ended(self, now: float) -> bool:
        """Return whether nothing has to be remembered any more."""
        return not self.omitted and now >= max(
            self.line_at + _APART_S, self.count_at, *self.shown.values())

    def pop_count(self, what: str, now: float) -> str:
        """Return how many messages were not written, as text, and begin to count again."""
        count, examples = self.omitted, '; '.join(map(printable, self.examples))
        text = f'{count} more {what} in {max(now - self.line_at, 0.0):.1f} s'
        self.omitted, self.line_at, self.examples = 0, now, []
        return text + (f', such as {examples}' if examples else '')


Text = str | Sequence[str]
"""A line, or a list of lines, in each of which a sender may choose any characters."""


class LimitedLog:
    """
    Writes at most a line a second for each kind and each sender, and counts the others.

    - A line about the same subject is repeated after ten seconds at the earliest.
    - The next line of a kind and a sender has the count of those that were not written. If none
      follows within a second, ``write_counts`` writes the count alone, at most once in ten
      seconds.
    - Ten senders of each kind are distinguished; all others count as one sender.

    A kind is the rule that was broken, and there are as many as the program names. It may be
    used from any thread.
    """

    def __init__(self, put: Callable[[str], object]) -> None:
        """
        Begin without messages.

        :param put: writes a line. rclpy allows one severity for each line of code that calls a
            logger, so a function of the caller's own has to call any other than ``warning``.
        """
        self._put = put
        self._lock = fork_locks.lock()
        # By kind and sender; None are all senders that are not distinguished.
        self._flows: dict[str, dict[str | None, _Flow]] = {}

    def write(self, kind: str, sender: str, text: Text | Callable[[], Text],
              about: str | None = '') -> bool:
        """
        Write a message, or count it; return whether it was written.

        :param kind: which rule was broken.
        :param sender: who broke it, as far as that is known; '': unknown.
        :param text: the message, or a function that returns it.
        :param about: the subject, such as an edge, which the count names; its first line counts.
            None: the message is news, even if it is like the one before.
        """
        sender = shorten(sender, _LONGEST)
        if about is not None:
            about = shorten(about.partition('\n')[0], _LONGEST)
        with self._lock:
            now = time.monotonic()
            lines = self._make_room(kind, sender, now)
            flows = self._flows.setdefault(kind, {})
            room = len(flows) < _MOST_SENDERS + (None in flows)
            known = sender if sender in flows or room else None
            flow = flows.setdefault(known, _Flow(now - _APART_S))
            if known is None and about is not None:  # the subject has to say whose it is
                about = f'{about} ({sender!r})' if about else repr(sender)
            admitted = flow.admits(about, now)
            if admitted:
                line = shorten(_escaped(text() if callable(text) else text), _LONGEST_LINE)
                if flow.omitted:
                    line += f' ({flow.pop_count(f"of this kind{_by(known)}", now)})'
                flow.line_at = now
                lines.append(line)
        self._put_all(lines)
        return admitted

    def write_counts(self) -> None:
        """Write the counts of floods that have ended; call this about once a second."""
        with self._lock:
            now = time.monotonic()
            lines = [line for kind in list(self._flows) for line in self._counts(kind, now)]
        self._put_all(lines)

    def _make_room(self, kind: str, sender: str, now: float) -> list[str]:
        """Forget senders that are silent now, if there is no room for another one."""
        flows = self._flows.get(kind, {})
        return self._counts(kind, now) if (
            len(flows) >= _MOST_SENDERS and sender not in flows) else []

    def _counts(self, kind: str, now: float) -> list[str]:
        """Return the counts of a kind that are due, and forget the flows that have ended."""
        flows, lines = self._flows[kind], []
        for sender, flow in list(flows.items()):
            if flow.owes_count(now):
                lines.append(flow.pop_count(f'like this{_by(sender)}: {kind},', now))
                flow.count_at = now + _PERIOD_S
            elif flow.has_ended(now):
                del flows[sender]
        if not flows:
            del self._flows[kind]
        return lines

    def _put_all(self, lines: Iterable[str]) -> None:
        for line in lines:
            self._put(line)


def _by(sender: str | None) -> str:
    """Return the sender as part of a sentence."""
    if sender is None:
        return f' from others than the {_MOST_SENDERS} senders named'
    return f' from {sender!r}' if sender else ''


def _escaped(text: Text) -> str:
    """Return a text with no other line breaks than those between its lines; escape controls."""
    lines = [text] if isinstance(text, str) else text
    return '\n'.join(printable(' '.join(line.splitlines())) for line in lines)


# --- what is logged

class Logger(Protocol):
    """Where lines are written: a logger of rclpy or of Python's ``logging``."""

    def warning(self, message: str, /) -> object:
        """Write one line."""


class IncidentLog(LimitedLog):
    """
    Writes incidents; the sender is the authority, and the subject the edge.

    :ivar logger: where they are written from now on.
    """

    def __init__(self, logger: Logger) -> None:
        """Begin without incidents."""
        super().__init__(lambda line: self.logger.warning(line))
        self.logger = logger

    def report(self, incidents: Iterable[Incident]) -> None:
        """Write or count each incident."""
        for incident in incidents:
            self.write(incident.kind.value, incident.authority, incident.__str__,
                       f'{incident.parent!r} -> {incident.child!r}')


class FailureLog(LimitedLog):
    """Writes exceptions with their tracebacks, which count as one line."""

    def report(self, what: str, sender: str = '', hint: str = '') -> None:
        """
        Write or count the exception that is being handled.

        :param what: what has failed.
        :param sender: whose message it was; '': unknown.
        :param hint: a sentence for the end.
        """
        error = sys.exc_info()[1]
        self.write(f'{what} failed with {type(error).__name__}', sender,
                   lambda: f'{what} failed:\n{traceback.format_exc()}{hint}'.split('\n'),
                   traceback.format_exception_only(error)[-1].strip())
