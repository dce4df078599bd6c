# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The known robots: which are present, and statistics of their messages.

A robot is present while it has a liveliness token. When a connection is lost, all tokens disappear
at once, which says nothing about the robots. A robot has therefore gone if its last token
disappeared and the connection remained, or if it has not returned some time after the connection
was restored. This file does not depend on Zenoh.
"""

from collections import Counter, deque
from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass
import math
import statistics
import threading
import time
from typing import Any

from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.stamp import from_seconds

from .names import Names, Report
from .trust import Allowance, FrameQuota, RobotQuota

# A token that disappears may be the first sign of a lost connection.
SETTLE_S = 0.5
# The time that robots may take to reconnect after a router has returned.
RETURN_S = 10.0
# The maximum number of tokens that are kept for a robot: each of its publishers may have one.
_MOST_TOKENS = 200


class Presence:
    """
    The present robots; may be used from any thread.

    :ivar connected: whether there is a connection; without one, no robot counts as gone.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        """
        Begin without robots.

        :param now: a monotonic clock, seconds.
        """
        self._now = now
        self._changed = threading.Condition()
        self.connected = False
        self._tokens: dict[str, set[str]] = {}
        self._leaving: dict[str, float] = {}
        self._here: set[str] = set()
        self._news: list[tuple[str, bool]] = []

    def see(self, robot: str, token: str = '') -> None:
        """Record that a robot is present: by a token, or by data alone."""
        with self._changed:
            if token:
                tokens = self._tokens.setdefault(robot, set())
                if len(tokens) < _MOST_TOKENS:
                    tokens.add(token)
                self._leaving.pop(robot, None)
            if robot not in self._here:
                self._here.add(robot)
                self._news.append((robot, True))
                self._changed.notify_all()

    def miss(self, robot: str, token: str) -> bool:
        """Record that a token has disappeared; return whether it was the robot's last one."""
        with self._changed:
            tokens = self._tokens.get(robot, set())
            was_last = tokens == {token}
            tokens.discard(token)
            if not tokens and self.connected and robot in self._here:
                self._leaving[robot] = self._now() + SETTLE_S
                self._changed.notify_all()
            return was_last

    def connect(self, connected: bool) -> None:
        """Record whether there is a connection; tokens from before must reappear in time."""
        with self._changed:
            self.connected = connected
            self._leaving.clear()
            if connected:
                for robot in self._here:
                    if self._tokens.get(robot) == set():
                        self._leaving[robot] = self._now() + RETURN_S
            self._changed.notify_all()

    def await_news(self, ended: threading.Event, longest_s: float) -> list[tuple[str, bool]]:
        """Return who appeared (True) or went: at the latest after some seconds or ``wake``."""
        with self._changed:
            news = self.news()
            if not news and not ended.is_set():
                self._changed.wait(min(self._rest_s(), longest_s))
                news = self.news()
            return news

    def wake(self) -> None:
        """Make ``await_news`` return; its event is set."""
        with self._changed:
            self._changed.notify_all()

    def news(self) -> list[tuple[str, bool]]:
        """Return the robots that appeared (True) and went since the last call."""
        with self._changed:
            now = self._now()
            for robot in [one for one, deadline in self._leaving.items() if deadline <= now]:
                del self._leaving[robot]
                self._here.discard(robot)
                self._news.append((robot, False))
            news, self._news = self._news, []
        return news

    def _rest_s(self) -> float:
        """Return the time until the next robot may have gone; infinite: no robot is leaving."""
        return max(0.0, min(self._leaving.values(), default=math.inf) - self._now())


# --- the roster

# Rates and lags are computed from this many recent messages.
_LATELY = 64
# A client that may write any key can invent publishers. More than these are not kept.
_MAX_SENDERS = 100
_MAX_MISSED = 1_000
# The longest time until all stored messages of a robot have arrived.
CATCH_UP = from_seconds(5.0)

Sender = tuple[str, int]
"""The sender of a message: a session of Zenoh, and a publisher in it."""


@dataclass(frozen=True)
class FleetRobot:
    """
    The current state of one robot.

    :ivar since: when it appeared, nanoseconds since 1970, by the clock of this machine.
    :ivar here: whether it is present, according to its liveliness tokens; a robot without tokens
        stays present, and ``silence`` is more informative.
    :ivar rate_hz: recent messages of moving transforms per second.
    :ivar lag: recent time from the stamp of a moving transform to its arrival, nanoseconds. It
        includes the difference of the two clocks. None: nothing has arrived.
    :ivar silence: time since the last moving transform, nanoseconds; None: there was none.
    :ivar transforms: how many were accepted.
    :ivar lost: messages that are known to be missing; it falls if they arrive later.
    :ivar recovered: messages that were sent without a connection and arrived later.
    :ivar refused: refused transforms, and undecodable messages.
    :ivar frames: how many frame names it has used, apart from shared ones.
    :ivar dropped: messages that were not decoded, because it sent more than its quota.
    :ivar limit: the limit that it reached last; '': none.
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
    frames: int = 0
    dropped: int = 0
    limit: str = ''

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


class RobotCounts:
    """
    The state of one robot; the roster's lock is held whenever it is used.

    :ivar back: when it last connected, nanoseconds: messages from before that arrive late.
    :ivar away: since when it has no liveliness token, nanoseconds; None: it has one, or never had.
    :ivar messages_before: the number of its messages until then.
    :ivar senders: its publishers, and the numbers of their last messages; -1: unknown.
    :ivar has_skipped: whether messages were dropped, so that these numbers are too old.
    """

    def __init__(self, now: int, quota: RobotQuota) -> None:
        self.since = self.back = now
        self.away: int | None = None
        self.here = True
        self.allowance = Allowance(quota, time.monotonic())
        self.frames = FrameQuota(quota.frames)
        self.transforms = self.recovered = self.refused = self.lost = self.dropped = 0
        self.limit = ''
        self.senders: dict[Sender, int] = {}
        self.has_skipped = False
        self.messages = self.messages_before = 0
        self._arrivals: deque[float] = deque(maxlen=_LATELY)
        self._lags: deque[int] = deque(maxlen=_LATELY)

    def come_back(self) -> None:
        """Record that it is received from now on."""
        self.back, self.messages_before = time.time_ns(), self.messages
        self.away = None

    def record_live(self, newest: int) -> None:
        """Record the arrival of moving transforms, and their newest stamp."""
        self._arrivals.append(time.monotonic())
        self._lags.append(time.time_ns() - newest)

    def number(self, sender: Sender, number: int) -> range | None:
        """
        Record the sender of a message and its number.

        :return: the missing numbers before it; None: the sender is one too many, and not kept.
        """
        if sender not in self.senders and len(self.senders) >= _MAX_SENDERS:
            return None
        if self.has_skipped:
            # The missing messages may be those that exceeded the quota.
            self.senders, self.has_skipped = dict.fromkeys(self.senders, -1), False
        before = self.senders.get(sender, -1)
        self.senders[sender] = max(number, before)
        return range(before + 1, number) if before >= 0 else range(0)

    def as_robot(self, name: str) -> FleetRobot:
        """Return the current state."""
        now, arrivals = time.monotonic(), self._arrivals
        span_s = now - arrivals[0] if arrivals else 0.0
        return FleetRobot(
            name, self.since, self.here, (len(arrivals) - 1) / span_s if span_s else 0.0,
            int(statistics.median(self._lags)) if self._lags else None,
            round(1e9 * (now - arrivals[-1])) if arrivals else None,
            self.transforms, max(0, self.lost), self.recovered, self.refused,
            len(self.frames), self.dropped, self.limit)


class Roster:
    """All robots by their names; may be used from any thread."""

    def __init__(self, apart: bool, quota: RobotQuota) -> None:
        """
        Begin without robots.

        :param apart: no robot may have a name that is the beginning of another's.
        :param quota: of each robot.
        """
        self._lock = threading.Lock()
        self._names = Names(apart, quota.names)
        self._quota = quota
        self._accounts: dict[str, RobotCounts] = {}
        self._robot_of: dict[Sender, str] = {}
        # The lost messages of publishers whose robot is not known yet.
        self._missed: Counter[Sender] = Counter()

    def admit(self, robot: str) -> tuple[bool, Report | None]:
        """Record a robot; return whether it is received, and what to report."""
        with self._lock:
            if robot in self._accounts:
                return True, None
            admitted, report = self._names.admit(robot)
            if admitted:
                self._accounts[robot] = RobotCounts(time.time_ns(), self._quota)
            return admitted, report

    @property
    def ignored(self) -> int:
        """Return how many tokens and messages had the name of a robot that is not received."""
        return self._names.refused

    def knows(self, robot: str) -> bool:
        """Return whether a robot was admitted."""
        return robot in self._accounts

    def appear(self, robot: str) -> None:
        """Record that a robot has appeared, or has returned."""
        with self._lock:
            account = self._accounts[robot]
            if not account.here:
                account.here, account.since = True, time.time_ns()

    def reconnect(self, robot: str) -> None:
        """Record that a robot is received from now on: messages from before arrive late."""
        with self._lock:
            self._accounts[robot].come_back()

    def disconnect(self, robot: str) -> None:
        """Record that a robot has lost its last token."""
        with self._lock:
            self._accounts[robot].away = time.time_ns()

    def leave(self, robot: str) -> None:
        """Record that a robot has gone."""
        with self._lock:
            self._accounts[robot].here = False

    def is_late(self, robot: str, sent: int) -> bool:
        """
        Return whether a message was sent before its robot was received; nanoseconds.

        Stored messages arrive at once. A robot that sends old messages later has a slow clock.
        Tokens and messages arrive in different threads, so a message may precede the token that
        shows the robot's return: the first message that was sent without a token shows it, too.
        """
        with self._lock:
            account = self._accounts[robot]
            if account.away is not None and sent > account.away:
                account.come_back()
            return sent < account.back and time.time_ns() < account.back + CATCH_UP

    def refusal(self, robot: str, size: int) -> str:
        """Record a message of so many bytes; return which limit it exceeds, or ''."""
        with self._lock:
            account = self._accounts[robot]
            limit = account.allowance.refusal(size, time.monotonic())
            account.has_skipped |= bool(limit)
            return limit

    def spend(self, robot: str, seconds: float) -> None:
        """Record the processor time that a message of a robot has cost."""
        with self._lock:
            self._accounts[robot].allowance.spend(seconds)

    def number(self, robot: str, sender: Sender, number: int, by_zenoh: bool) -> range:
        """
        Record the sender of a message and its number; return the missing numbers before it.

        :param by_zenoh: Zenoh itself reports missing messages, see ``miss``.
        """
        with self._lock:
            account = self._accounts[robot]
            missing = account.number(sender, number)
            if missing is None:
                return range(0)
            self._robot_of.setdefault(sender, robot)
            account.lost += self._missed.pop(sender, 0) + (0 if by_zenoh else len(missing))
            return missing

    def drop(self, robot: str, limit: str) -> None:
        """Record a message that was dropped because of a limit."""
        with self._lock:
            account = self._accounts[robot]
            account.dropped += 1
            account.limit = limit

    def within_frames(self, robot: str, batch: Batch, shared: Collection[str]) -> Batch:
        """Return a message without the edges whose frames exceed its robot's quota."""
        with self._lock:
            account = self._accounts[robot]
            fitting = account.frames.admitted(batch, shared)
            if fitting is not batch:
                account.limit = f'more than {self._quota.frames} frames (frames)'
            return fitting

    def record(self, robot: str, taken: int, refused: int, newest: int | None, late: bool) -> None:
        """
        Record the result of inserting a message.

        :param taken: the number of accepted transforms.
        :param refused: the number of refused ones.
        :param newest: its newest stamp, if it is of moving transforms.
        :param late: see ``is_late``.
        """
        with self._lock:
            account = self._accounts[robot]
            account.transforms += taken
            account.refused += refused
            account.recovered += late and account.messages_before > 0
            account.messages += 1
            if newest is not None and not late:
                account.record_live(newest)

    def find(self, robot: str) -> None:
        """Record that a lost message has arrived after all."""
        with self._lock:
            # Below zero, if it is reported as missing only after this, in another thread.
            self._accounts[robot].lost -= 1

    def miss(self, sender: Sender, count: int) -> None:
        """Record lost messages, which may still be found."""
        with self._lock:
            robot = self._robot_of.get(sender)
            if robot is not None:
                self._accounts[robot].lost += count
            elif sender in self._missed or len(self._missed) < _MAX_MISSED:
                self._missed[sender] += count

    def robots(self) -> list[FleetRobot]:
        """Return all known robots, by name."""
        with self._lock:
            return [account.as_robot(name) for name, account in sorted(self._accounts.items())]
