# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The flight recorder: the messages of the last seconds, saved as a bag after an incident.

The messages of the last seconds, and the last static ones, are kept in limited memory.
"""

from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime
import json
import os
from pathlib import Path
import re
import threading

from tf_tree_py.core import fork_locks
from tf_tree_py.core.errors import TransformException, TreeFileError
from tf_tree_py.core.messages.observers import End, Observer, ReceivedMessage
from tf_tree_py.core.messages.sample import Edge
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.files.whole_files import write_whole

from . import bag_writer

# The approximate memory of a message, of each of its transforms, and of each edge's names; all
# messages of one layout share the names.
_MESSAGE_BYTES, _TRANSFORM_BYTES, _EDGE_BYTES = 300, 140, 160

Edges = Sequence[Edge]


@dataclass
class _Names:
    """
    The names that some messages share.

    :ivar authority: the publisher of the first of these messages; all bytes count as its own.
    """

    layout: object
    edges: Edges
    authority: str
    messages: int = 0

    @property
    def size(self) -> int:
        """Return the approximate memory of the names, bytes."""
        return sum(_EDGE_BYTES + len(parent) + len(child) for parent, child in self.edges)


class RecentMessages:
    """
    Keeps messages; above the limit it removes the oldest of the publisher with the most bytes.

    It is not thread-safe.

    :ivar now: the time of the last arrival, nanoseconds.
    :ivar size: the approximate memory of all messages, bytes.
    """

    def __init__(self, last: int, most_bytes: int) -> None:
        """
        Begin without messages.

        :param last: how long moving transforms are kept, nanoseconds.
        """
        self._last, self._most_bytes = last, most_bytes
        self.now = self.size = 0
        self._moving: deque[ReceivedMessage] = deque()
        # In order of their last renewal.
        self._static: dict[tuple[tuple[str, str], ...], ReceivedMessage] = {}
        self._names: dict[object, _Names] = {}
        self._bytes: Counter[str] = Counter()

    def moving(self) -> list[ReceivedMessage]:
        """Return the messages of moving edges, in the order of arrival."""
        return list(self._moving)

    def static(self) -> list[ReceivedMessage]:
        """Return the last message of each set of static edges, in the order of arrival."""
        return list(self._static.values())

    def add(self, arrival: ReceivedMessage) -> None:
        """Keep a message; remove those that are too old or exceed the memory."""
        if not arrival.received:
            arrival = arrival._replace(received=self.now)
        self.now = arrival.received
        self._count(arrival)
        if arrival.static:
            edges = tuple(arrival.batch.edges)
            before = self._static.pop(edges, None)
            self._static[edges] = arrival
            if before is not None:
                self._discount(before)
        else:
            self._moving.append(arrival)
            self._forget_old()
        while self.size > self._most_bytes:
            self._forget_oldest_of(max(self._bytes, key=self._bytes.__getitem__))

    def _forget_old(self) -> None:
        oldest = self.now - self._last
        # After a jump back of time, the earlier messages are older, although they look newer.
        while self._moving and not oldest <= self._moving[0].received <= self.now:
            self._discount(self._moving.popleft())

    def _forget_oldest_of(self, authority: str) -> None:
        """Remove a publisher's oldest message of moving edges, or else a static one."""
        for place, arrival in enumerate(self._moving):
            if self._names_of(arrival).authority == authority:
                del self._moving[place]
                return self._discount(arrival)
        edges = next(edges for edges, arrival in self._static.items()
                     if self._names_of(arrival).authority == authority)
        self._discount(self._static.pop(edges))

    # --- counting bytes

    def _names_of(self, arrival: ReceivedMessage) -> _Names:
        return self._names[arrival.batch.layout]

    def _count(self, arrival: ReceivedMessage) -> None:
        layout = arrival.batch.layout
        names = self._names.get(layout)
        if names is None:
            names = self._names[layout] = _Names(layout, arrival.batch.edges, arrival.authority)
            self._charge(names, names.size)
        names.messages += 1
        self._charge(names, _own_size(arrival))

    def _discount(self, arrival: ReceivedMessage) -> None:
        names = self._names_of(arrival)
        names.messages -= 1
        self._charge(names, -_own_size(arrival))
        if not names.messages:
            del self._names[names.layout]
            self._charge(names, -names.size)
            if not self._bytes[names.authority]:
                del self._bytes[names.authority]

    def _charge(self, names: _Names, size: int) -> None:
        self._bytes[names.authority] += size
        self.size += size


def _own_size(arrival: ReceivedMessage) -> int:
    return _MESSAGE_BYTES + _TRANSFORM_BYTES * len(arrival.batch.edges)


# --- the recorder

LOOKUP_FAILED = 'lookup_failed'
"""The reason for a bag: a lookup between two frames failed that worked before."""

TOO_SOON, NOTHING = 'the last bag was written too recently', 'no message has arrived'
"""The reasons for not writing a bag, other than errors."""

_DEFAULT_MOST_BYTES = 200_000_000
"""The default memory of a recorder: half a minute of a hundred robots with 25 moving frames."""

# Only a program that invents names uses more pairs of frames than this.
_MAX_PAIRS = 1_000
_PATTERN = 'flight_*.mcap'


@dataclass(frozen=True)
class Happened:
    """
    The reason for a recording.

    :ivar why: one word: a code of the doctor, ``lookup_failed``, or ``asked``.
    :ivar summary: one sentence.
    :ivar stamp: the time by the clock of the arrivals, nanoseconds.
    :ivar frames: the affected frames.
    :ivar findings: the findings of the doctor as plain data, if there is a doctor.
    """

    why: str
    summary: str
    stamp: int = 0
    frames: tuple[str, ...] = ()
    findings: Sequence[Mapping[str, object]] = field(default=())


Notify = Callable[[Happened, Path | None, str], None]


class FlightRecorder(Observer):
    """
    Keeps the whole messages of the last seconds in memory, and writes them to a bag.

    It is an ``Observer`` of a buffer: it keeps all messages with their times of arrival,
    including those that the buffer refuses; for static edges it keeps the last message. A
    message costs a few microseconds and the memory of its numbers: 5 kB for 38 transforms. A
    lookup takes about ten microseconds longer. Writing takes half a millisecond per message of
    that size; after a failed lookup it runs in a separate thread. A JSON file next to each bag
    describes the incident; so does the bag's metadata. It may be used from any thread.

    ``Buffer(flight_recorder=FlightRecorder('incidents'))`` writes a bag when a lookup fails
    that worked before.
    """

    def __init__(self, folder: str | os.PathLike[str] = '.', *,
                 last: int = from_seconds(30.0), every: int = from_seconds(60.0),
                 keep: int = 10, notify: Notify | None = None,
                 most_bytes: int = _DEFAULT_MOST_BYTES) -> None:
        """
        Begin without messages.

        :param folder: for the bags; created if it does not exist.
        :param last: the time span that is kept in memory, nanoseconds.
        :param every: at most one bag is written in this time, nanoseconds.
        :param keep: the number of bags that stay in the folder; the oldest are removed.
        :param notify: called after each attempt with the reason for it, the bag's path or None,
            and the reason why there is no bag.
        :param most_bytes: the approximate memory that messages may take; beyond it, the oldest
            messages of the publisher, or the robot, that has sent the most are removed.
        """
        self.folder = Path(folder)
        self._every, self._keep, self.notify = every, keep, notify
        self._lock = fork_locks.lock()
        self._messages = RecentMessages(last, most_bytes)
        self._written: int | None = None
        self._worked: set[tuple[str, str]] = set()
        self._writers: list[threading.Thread] = []

    # --- receiving

    def received(self, arrival: ReceivedMessage) -> None:
        """Keep a message; samples that a program inserts itself are not messages."""
        if arrival.topic:
            with self._lock:
                self._messages.add(arrival)

    def asked(self, target: str, source: str, stamp: int | None) -> End:
        """Observe a lookup; write if it fails and the last one between these frames did not."""
        pair = str(target), str(source)

        def ended(error: TransformException | None) -> None:
            if error is None:
                if len(self._worked) < _MAX_PAIRS:
                    self._worked.add(pair)
            elif pair in self._worked:
                self._worked.discard(pair)
                self.write_soon(Happened(LOOKUP_FAILED, str(error), self._messages.now, pair))

        return ended

    # --- writing

    def write_soon(self, happened: Happened) -> threading.Event:
        """
        Write in a thread, which ``close`` waits for; return an event that is set at its end.

        It is for callers that must not block, or that a signal may interrupt. They wait for the
        event: Python 3.12 regards a thread as ended after an interrupted ``join``.
        """
        has_ended = threading.Event()

        def write() -> None:
            try:
                self.write(happened)
            finally:
                has_ended.set()

        thread = threading.Thread(target=write, name='flight recorder')
        # Before it starts: a signal may interrupt that, too.
        self._writers = [one for one in self._writers if one.is_alive()] + [thread]
        thread.start()
        return has_ended

    def write(self, happened: Happened) -> Path | None:
        """
        Write the messages to a bag, unless the last bag was written too recently.

        :return: the bag; None: none was written, and ``notify`` was called with the reason.
        """
        moving, static, why_not = self._next()
        if why_not:
            return self._notify(happened, None, why_not)
        try:
            path = self._path(happened.why)
            self._write(path, moving, static, happened)
        except (TreeFileError, OSError) as error:
            return self._notify(happened, None, str(error))
        self._tidy()
        return self._notify(happened, path, '')

    def _next(self) -> tuple[list[ReceivedMessage], list[ReceivedMessage], str]:
        """Return the moving and the static messages to write; or why not to write now."""
        with self._lock:
            now = self._messages.now
            if self._written is not None and abs(now - self._written) < self._every:
                return [], [], TOO_SOON
            moving, static = self._messages.moving(), self._messages.static()
            if not moving and not static:
                return [], [], NOTHING
            self._written = now
            return moving, static, ''

    def close(self) -> None:
        """Wait for the writers to finish."""
        for thread in self._writers:
            if thread.ident is not None:  # otherwise it was never started
                thread.join()

    def _notify(self, happened: Happened, path: Path | None, why_not: str) -> Path | None:
        if self.notify is not None:
            self.notify(happened, path, why_not)
        return path

    def _path(self, why: str) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        name = f'flight_{datetime.now():%Y%m%d_%H%M%S_%f}_{re.sub("[^a-z_]", "", why)}.mcap'
        return self.folder / name

    def _write(self, path: Path, moving: Sequence[ReceivedMessage],
               static: Sequence[ReceivedMessage], happened: Happened) -> None:
        begin = min((arrival.received for arrival in moving), default=self._messages.now)
        messages = bag_writer.as_arrived([
            *(arrival._replace(received=begin) for arrival in static), *moving])
        story = json.dumps({**asdict(happened), 'bag': path.name,
                            'messages': len(moving) + len(static)}, indent=2)
        bag_writer.write(messages, path, {'tf_tree_py': story})
        write_whole(path.with_suffix('.json'), [story.encode(), b'\n'])

    def _tidy(self) -> None:
        """Remove the oldest bags of this folder, with their JSON files."""
        for path in sorted(self.folder.glob(_PATTERN))[:-self._keep]:
            path.unlink(missing_ok=True)
            path.with_suffix('.json').unlink(missing_ok=True)
