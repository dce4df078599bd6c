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

"""The flight recorder: the last seconds of what arrived, and a bag of them when it matters."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime
import importlib
import json
import os
from pathlib import Path
import re
import threading
from typing import Any

from .arrivals.observers import End, Observer
from .arrivals.received import Received
from .errors import TransformException, TreeFileError
from .stamp import from_seconds

LOOKUP_FAILED = 'lookup_failed'
"""The reason for a bag: a lookup between two frames failed that had worked before."""

# More pairs of frames, and more static edges, come only from a program that invents names.
_MAX_PAIRS = 1_000
_MAX_STATIC = 1_000
_PATTERN = 'flight_*.mcap'


@dataclass(frozen=True)
class Happened:
    """
    Why a recording is written.

    :ivar why: one word: a code of the doctor, ``lookup_failed``, or ``asked``.
    :ivar summary: one sentence.
    :ivar stamp: when, by the clock of the arrivals, nanoseconds.
    :ivar frames: whom it concerns.
    :ivar findings: what the doctor says, as plain data, if one watches.
    """

    why: str
    summary: str
    stamp: int = 0
    frames: tuple[str, ...] = ()
    findings: Sequence[dict[str, Any]] = field(default=())


Notify = Callable[[Happened, Path | None, str], None]


class FlightRecorder(Observer):
    """
    Keeps whole messages of the last seconds in memory, and writes them as a bag.

    An ``Observer`` of a buffer: it hears messages as they arrive, those too that the buffer
    refuses, and keeps their times of arrival; of static edges the last message. A message
    costs less than a microsecond, and as much memory as it has numbers: 5 kB with 38
    transforms. A lookup costs some ten microseconds more. Writing takes half a millisecond
    a message of that size, in a thread of its own where lookups fail. Beside
    each bag stands a JSON file that says what happened; the bag's own metadata says it too.
    May be fed and asked from any thread.

    ``Buffer(flight_recorder=FlightRecorder('incidents'))`` writes on the first lookup that
    fails after it had worked.
    """

    def __init__(self, folder: str | os.PathLike[str] = '.', *,
                 last: int = from_seconds(30.0), every: int = from_seconds(60.0),
                 keep: int = 10, notify: Notify | None = None) -> None:
        """
        Begin with nothing.

        :param folder: for the bags; made if it is not there.
        :param last: how much is kept in memory, nanoseconds.
        :param every: at most one bag is written in so long, nanoseconds.
        :param keep: so many bags stay in the folder; the oldest are removed.
        :param notify: called after each attempt with what happened, with the bag's path or None,
            and with why there is none.
        """
        self.folder = Path(folder)
        self._last, self._every, self._keep, self.notify = last, every, keep, notify
        self._lock = threading.Lock()
        self._moving: deque[Received] = deque()
        self._static: dict[Any, Received] = {}
        self._now = 0
        self._written: int | None = None
        self._worked: set[tuple[str, str]] = set()
        self._writers: list[threading.Thread] = []

    # --- hearing

    def received(self, arrival: Received) -> None:
        """Keep a message."""
        with self._lock:
            self._now = arrival.received or self._now
            if arrival.static:
                if len(self._static) < _MAX_STATIC:
                    self._static[tuple(arrival.batch.edges)] = arrival
                return
            self._moving.append(arrival)
            oldest = self._now - self._last
            # After a jump back what came before it is older than all, though it looks newer.
            while self._moving and not oldest <= self._moving[0].received <= self._now:
                self._moving.popleft()

    def asked(self, target: str, source: str, stamp: int | None) -> End:
        """Hear of a lookup; write if it fails and the last one between these frames did not."""
        pair = str(target), str(source)

        def ended(error: TransformException | None) -> None:
            if error is None:
                if len(self._worked) < _MAX_PAIRS:
                    self._worked.add(pair)
            elif pair in self._worked:
                self._worked.discard(pair)
                self.write_soon(Happened(LOOKUP_FAILED, str(error), self._now, pair))

        return ended

    # --- writing

    def write_soon(self, happened: Happened) -> None:
        """Write in a thread, for whoever must not wait; ``close`` waits for it."""
        thread = threading.Thread(target=self.write, args=(happened,), name='flight recorder')
        self._writers = [one for one in self._writers if one.is_alive()] + [thread]
        thread.start()

    def write(self, happened: Happened) -> Path | None:
        """
        Write what is kept, unless the last time was too short ago.

        :return: the bag; None: none was written, and ``notify`` has heard why.
        """
        with self._lock:
            if self._written is not None and abs(self._now - self._written) < self._every:
                return self._tell(happened, None, 'the last one was too short ago')
            moving, static = list(self._moving), list(self._static.values())
            if moving or static:
                self._written = self._now
        if not moving and not static:
            return self._tell(happened, None, 'nothing has arrived')
        try:
            path = self._path(happened.why)
            self._write(path, moving, static, happened)
        except (TreeFileError, OSError) as error:
            return self._tell(happened, None, str(error))
        self._tidy()
        return self._tell(happened, path, '')

    def close(self) -> None:
        """Wait for what is being written."""
        for thread in self._writers:
            thread.join()

    def _tell(self, happened: Happened, path: Path | None, why_not: str) -> Path | None:
        if self.notify is not None:
            self.notify(happened, path, why_not)
        return path

    def _path(self, why: str) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        name = f'flight_{datetime.now():%Y%m%d_%H%M%S_%f}_{re.sub("[^a-z_]", "", why)}.mcap'
        return self.folder / name

    def _write(self, path: Path, moving: Sequence[Received], static: Sequence[Received],
               happened: Happened) -> None:
        # The layer that knows bags stands above this one, so nothing here imports it by itself.
        recorder = importlib.import_module('tf_tree_py.bag.recorder')
        begin = min((arrival.received for arrival in moving), default=self._now)
        messages = recorder.as_arrived([
            *(arrival._replace(received=begin) for arrival in static), *moving])
        story = json.dumps({**asdict(happened), 'bag': path.name,
                            'messages': len(moving) + len(static)}, indent=2)
        recorder.write(messages, path, {'tf_tree_py': story})
        path.with_suffix('.json').write_text(story + '\n')

    def _tidy(self) -> None:
        """Remove the oldest bags of this folder, with what stands beside them."""
        for path in sorted(self.folder.glob(_PATTERN))[:-self._keep]:
            path.unlink(missing_ok=True)
            path.with_suffix('.json').unlink(missing_ok=True)
