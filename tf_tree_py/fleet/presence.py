# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The present robots, by their liveliness tokens.

When a connection is lost, all tokens disappear at once, which says nothing about the robots. A
robot has therefore gone if its last token disappeared and the connection remained, or if it has
not returned some time after the connection was restored. This file does not depend on Zenoh.
"""

from collections.abc import Callable
import threading

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

    def await_news(self, ended: threading.Event) -> list[tuple[str, bool]]:
        """Return who appeared (True) or went, as soon as there is a change; or after ``wake``."""
        with self._changed:
            while True:
                news = self.news()
                if news or ended.is_set():
                    return news
                self._changed.wait(self._rest_s())

    def wake(self) -> None:
        """Make ``await_news`` check whether it has to end."""
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

    def _rest_s(self) -> float | None:
        """Return the time until the next robot may have gone; None: no robot is leaving."""
        return max(0.0, min(self._leaving.values()) - self._now()) if self._leaving else None
