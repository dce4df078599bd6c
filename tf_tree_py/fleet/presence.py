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

"""
Which robots are there, by their liveliness tokens.

When a connection is lost, all tokens go at once, and that says nothing of any robot. So
a robot has gone when its last token went and the connection stayed, or when it has not come
back some time after the connection did. This file knows no Zenoh.
"""

from collections.abc import Callable
import threading

# A token that went may be the first sign of a lost connection.
SETTLE_S = 0.5
# How long robots may take to reconnect to a router that is there again.
RETURN_S = 10.0


class Presence:
    """
    Who is there; may be used from any thread.

    :ivar connected: whether there is a connection; until then nobody can be seen to go.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        """
        Begin with nobody.

        :param now: a clock that always goes, seconds.
        """
        self._now = now
        self._changed = threading.Condition()
        self.connected = False
        self._tokens: dict[str, set[str]] = {}
        self._leaving: dict[str, float] = {}
        self._here: set[str] = set()
        self._news: list[tuple[str, bool]] = []

    def see(self, robot: str, token: str = '') -> None:
        """Note that a robot is there: by a token, or by data alone."""
        with self._changed:
            if token:
                self._tokens.setdefault(robot, set()).add(token)
                self._leaving.pop(robot, None)
            if robot not in self._here:
                self._here.add(robot)
                self._news.append((robot, True))
                self._changed.notify_all()

    def miss(self, robot: str, token: str) -> None:
        """Note that a token has gone."""
        with self._changed:
            tokens = self._tokens.get(robot, set())
            tokens.discard(token)
            if not tokens and self.connected and robot in self._here:
                self._leaving[robot] = self._now() + SETTLE_S
                self._changed.notify_all()

    def connect(self, connected: bool) -> None:
        """Note whether there is a connection; who had a token has to show it again, in time."""
        with self._changed:
            self.connected = connected
            self._leaving.clear()
            if connected:
                for robot in self._here:
                    if self._tokens.get(robot) == set():
                        self._leaving[robot] = self._now() + RETURN_S
            self._changed.notify_all()

    def await_news(self, ended: threading.Event) -> list[tuple[str, bool]]:
        """Return who came (True) and went, as soon as somebody did; or when ``wake`` is called."""
        with self._changed:
            while True:
                news = self.news()
                if news or ended.is_set():
                    return news
                self._changed.wait(self._rest_s())

    def wake(self) -> None:
        """Let who awaits news see whether that has ended."""
        with self._changed:
            self._changed.notify_all()

    def news(self) -> list[tuple[str, bool]]:
        """Return who came (True) and went since the last call."""
        with self._changed:
            now = self._now()
            for robot in [one for one, deadline in self._leaving.items() if deadline <= now]:
                del self._leaving[robot]
                self._here.discard(robot)
                self._news.append((robot, False))
            news, self._news = self._news, []
        return news

    def _rest_s(self) -> float | None:
        """Return when the next may have gone; None: not before something changes."""
        return max(0.0, min(self._leaving.values()) - self._now()) if self._leaving else None
