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

"""The robots that were heard of, and what became of what they sent."""

from collections import Counter, deque
from dataclasses import asdict, dataclass
import statistics
import threading
import time
from typing import Any

from tf_tree_py.core.stamp import from_seconds

# Rates and lags are those of so many messages.
_LATELY = 64
# Whoever may write any key may invent robots, and publishers; more are not kept.
_MAX_ROBOTS = 10_000
_MAX_SOURCES = 100_000
# How long it takes at most until all that robots have kept has come.
_CATCH_UP = from_seconds(5.0)

Source = tuple[str, int]
"""Who sends: a session of Zenoh, and a publisher in it."""


@dataclass(frozen=True)
class Robot:
    """
    One robot, as it was just now.

    :ivar since: when it appeared, nanoseconds since 1970 by this machine's clock.
    :ivar here: whether it is there, as its liveliness tokens say; a robot that declares none
        stays, and ``silence`` tells more.
    :ivar rate_hz: messages of what moves a second, of late.
    :ivar lag: from the stamp of what moves to its arrival, nanoseconds, of late; with the
        difference of the two clocks. None: nothing has come.
    :ivar silence: since when nothing that moves has come, nanoseconds; None: nothing ever has.
    :ivar transforms: how many were taken.
    :ivar lost: messages that are known to be lost.
    :ivar recovered: messages that were sent while there was no connection, and came later.
    :ivar refused: transforms, and messages that are none, that were not taken.
    """

    name: str
    since: int
    here: bool
    rate_hz: float
    lag: int | None
    silence: int | None
    transforms: int
    lost: int
    recovered: int
    refused: int

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


class Account:
    """
    What is known of one robot; the roster's lock is held whenever it is used.

    :ivar back: when it could be heard anew, nanoseconds: what was sent before comes late.
    :ivar messages_before: how many of its messages had come by then.
    """

    def __init__(self, now: int) -> None:
        self.since = self.back = now
        self.here = True
        self.transforms = self.recovered = self.refused = 0
        self.messages = self.messages_before = 0
        self._arrivals: deque[float] = deque(maxlen=_LATELY)
        self._lags: deque[int] = deque(maxlen=_LATELY)

    def take_live(self, newest: int) -> None:
        """Note that what moves has come just now; its newest stamp."""
        self._arrivals.append(time.monotonic())
        self._lags.append(time.time_ns() - newest)

    def told(self, name: str, lost: int) -> Robot:
        """Return what is known now."""
        now, arrivals = time.monotonic(), self._arrivals
        span_s = now - arrivals[0] if arrivals else 0.0
        return Robot(
            name, self.since, self.here, (len(arrivals) - 1) / span_s if span_s else 0.0,
            int(statistics.median(self._lags)) if self._lags else None,
            round(1e9 * (now - arrivals[-1])) if arrivals else None,
            self.transforms, lost, self.recovered, self.refused)


class Roster:
    """All robots by their names; may be used from any thread."""

    def __init__(self, apart: bool) -> None:
        """
        Begin with nobody.

        :param apart: no robot may have a name that is the beginning of another's.
        """
        self._lock = threading.Lock()
        self._apart = apart
        self._accounts: dict[str, Account] = {}
        # What the names of robots begin with, up to a slash.
        self._above: set[str] = set()
        self._lost: Counter[Source] = Counter()
        self._robot_of: dict[Source, str] = {}
        self._numbers: dict[Source, int] = {}

    def admit(self, robot: str) -> str:
        """Note that a robot was heard of; return why it is not heard, or ''."""
        with self._lock:
            if robot in self._accounts:
                return ''
            if len(self._accounts) >= _MAX_ROBOTS:
                return f'there are {_MAX_ROBOTS} robots already'
            above = _above(robot) if self._apart else ()
            if robot in self._above or any(name in self._accounts for name in above):
                return 'its frames would get among those of another, or they among its own'
            self._above.update(above)
            self._accounts[robot] = Account(time.time_ns())
        return ''

    def appear(self, robot: str) -> None:
        """Note that a robot has come, or has come back."""
        with self._lock:
            account = self._accounts[robot]
            if not account.here:
                account.here, account.since = True, time.time_ns()

    def reconnect(self, robot: str) -> None:
        """Note that a robot can be heard from now on: what it sent before comes late."""
        with self._lock:
            account = self._accounts[robot]
            account.back, account.messages_before = time.time_ns(), account.messages

    def leave(self, robot: str) -> None:
        """Note that a robot has gone."""
        with self._lock:
            self._accounts[robot].here = False

    def is_late(self, robot: str, sent: int) -> bool:
        """
        Return whether a message was sent before its robot could be heard; nanoseconds.

        What was kept comes at once. Later on, who sends old messages has a slow clock.
        """
        back = self._accounts[robot].back
        return sent < back and time.time_ns() < back + _CATCH_UP

    def take(self, robot: str, taken: int, refused: int, newest: int | None, late: bool,
             source: Source | None, number: int | None = None) -> None:
        """
        Note a message.

        :param taken: how many of its transforms were; how many were refused.
        :param newest: its newest stamp, if it moves.
        :param late: see ``is_late``.
        :param source: who has sent it, if that is told.
        :param number: which of its sender's it is, where Zenoh does not miss those between.
        """
        with self._lock:
            account = self._accounts[robot]
            account.transforms += taken
            account.refused += refused
            account.recovered += late and account.messages_before > 0
            account.messages += 1
            if newest is not None and not late:
                account.take_live(newest)
            if source is not None and self._remembers(source):
                self._robot_of.setdefault(source, robot)
                if number is not None:
                    before = self._numbers.get(source, number)
                    self._lost[source] += max(0, number - before - 1)
                    self._numbers[source] = max(number, before)

    def miss(self, source: Source, count: int) -> None:
        """Note that messages were lost."""
        with self._lock:
            if self._remembers(source):
                self._lost[source] += count

    def robots(self) -> list[Robot]:
        """Return all robots that were heard of, by name."""
        with self._lock:
            lost = self._losses()
            return [account.told(name, lost[name])
                    for name, account in sorted(self._accounts.items())]

    def _remembers(self, source: Source) -> bool:
        return (source in self._lost or source in self._robot_of
                or len(self._lost) + len(self._robot_of) < _MAX_SOURCES)

    def _losses(self) -> Counter[str]:
        losses: Counter[str] = Counter()
        for source, count in self._lost.items():
            losses[self._robot_of.get(source, '')] += count
        return losses


def _above(robot: str) -> list[str]:
    """Return what a name begins with, up to each of its slashes."""
    parts = robot.split('/')
    return ['/'.join(parts[:count]) for count in range(1, len(parts))]
