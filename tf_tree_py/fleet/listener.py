# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Receives the transforms of a fleet, and fills a buffer."""

import atexit
from collections.abc import Callable, Collection, Sequence
import threading
import time
from typing import Final

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_CACHE_TIME, DEFAULT_MAX_FRAMES
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.messages.message_layout import as_published
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND, UNLIMITED
from tf_tree_py.core.times import checked_cache_time

from .connection import Connection, FleetLogs, log
from .keys import (
    check_prefix,
    check_robot,
    check_robots,
    is_nameless_bridge,
    Topic,
    topic_of,
    topic_of_token,
)
from .reception import Reception
from .requests import Requests, Subscriptions
from .roster import FleetRobot, Presence, Roster
from .session import (
    CLOSE_S,
    configuration,
    Connect,
    FleetError,
    needs_zenoh,
    one_or_several,
    PathLike,
    refuse_larger,
    zenoh_call,
)
from .transform_decoder import Inbox, RobotPlace, TransformDecoder
from .trust import checked_shared, names_below, RobotQuota

_OnRobot = Callable[[str, bool], object]

# The maximum number of frames of a whole fleet in one buffer.
_MAX_FRAMES: Final = 200_000
# How often the counts of messages that were not logged may be due, seconds.
_TICK_S: Final = 1.0
# The size of the largest message that Zenoh assembles, bytes; a quota refuses far smaller ones.
_LARGEST: Final = 8_000_000
# No robot has this name.
_ALL: Final = ''


class FleetListener(Closable):
    """
    Fills a buffer with the transforms that robots send over Zenoh; needs no ROS.

    Every robot's frames get its name as a prefix, ``robot7/base_link``, except for the shared
    ones. It reads in its own threads, so any thread may wait for a lookup. It connects and
    reconnects by itself, and may be created before there is a router.

    It lives until ``close()``; it is a context manager.

    :ivar name: the routers, for people.
    """

    def __init__(self, connect: Connect | None = None, robots: str | Collection[str] = '*', *,
                 shared_frames: Collection[str] = ('map',), separate: bool = False,
                 cache_time: int | None = None, config: PathLike | None = None,
                 key_prefix: str = '', on_robot: _OnRobot | None = None,
                 observers: Sequence[Observer] = (), quota: RobotQuota | None = None) -> None:
        """
        Begin to listen.

        :param connect: a router, such as ``tcp/hall:7447``, or several; None: those of ``config``.
        :param robots: a name, or a pattern such as ``robot*``; or several. ``*`` matches anything
            but a slash, and ``**`` alone matches anything.
        :param shared_frames: frames that get no prefix. A robot may attach its frames below them,
            but must not attach them elsewhere.
        :param separate: fill a buffer for each robot, ``listener['robot7']``, with the robot's own
            frame names.
        :param cache_time: the length of the history of each edge, nanoseconds; 10 s unless given.
        :param config: a configuration file of Zenoh: TLS, user and password, and all other
            settings.
        :param key_prefix: precedes the robots' names in keys.
        :param on_robot: called with a robot's name and whether it is present, when that changes;
            in the listener's own thread.
        :param observers: observe every buffer from the first message on.
        :param quota: the limits for each robot; see ``RobotQuota``.
        :raises FleetError: Zenoh is not installed, or an argument is invalid.
        """
        self._robots = _checked_robots(robots)
        self._key_prefix = check_prefix(key_prefix)
        self._shared = checked_shared(shared_frames)
        self._cache_time = (DEFAULT_CACHE_TIME if cache_time is None
                            else checked_cache_time(cache_time))
        self._separate = separate
        made = configuration(connect, config)
        refuse_larger(made, _LARGEST)
        self._wanted = [needs_zenoh().KeyExpr(pattern) for pattern in self._robots]
        self._on_robot = _checked_callback(on_robot)
        self._observers = observers
        self._buffers_lock = threading.Lock()
        self._buffers: dict[str, BufferCore] = {}
        self._quota = RobotQuota() if quota is None else quota
        self._roster = Roster(apart=not separate, quota=self._quota)
        self._presence = Presence(time.monotonic)
        self._inbox = Inbox(self._quota.waiting_bytes)
        self._logs = FleetLogs()
        self._heard: set[str] = set()
        self._warned_of_bridge = False
        self._closed = threading.Event()
        self._link = Connection(made, self._logs, self._presence.connect)
        self.name = self._link.name
        self._thread = threading.Thread(target=self._run, name='fleet', daemon=True)
        # The end of the program only waits until its thread ends.
        atexit.register(self.close)
        self._thread.start()

    # --- the buffers and the robots

    @property
    def buffer(self) -> BufferCore:
        """
        Return the buffer with all robots' frames.

        :raises FleetError: there is one for each robot.
        """
        if self._separate:
            raise FleetError("each robot has a buffer of its own: listener['robot7']")
        return self._buffer_of(_ALL)

    def __getitem__(self, robot: str) -> BufferCore:
        """
        Return the buffer of a robot, which need not be present yet.

        :raises FleetError: there is one buffer for all, or no robot can have that name.
        """
        if not self._separate:
            raise FleetError('all robots are in listener.buffer; separate=True gives each its own')
        return self._buffer_of(check_robot(robot))

    def robots(self) -> list[FleetRobot]:
        """Return all known robots, by name, including those that have gone."""
        return self._roster.robots()

    @property
    def ignored(self) -> int:
        """
        Return how many tokens and messages were ignored because their robot's name is refused.

        The log says which names, and why.
        """
        return self._roster.ignored

    @property
    def connected(self) -> bool:
        """Return whether there is a connection now."""
        return self._presence.connected

    def why_not_connected(self) -> str:
        """
        Return why there is no connection, as far as this machine can find it, or ''.

        Without a connection, this checks the files of TLS and contacts the router, which takes a
        second.
        """
        return '' if self.connected else self._link.why_not()

    def close(self) -> None:
        """
        Stop listening; the contents of the buffers stay.

        This takes two seconds at most: if the router or ``on_robot`` hangs, the connection is
        closed later, in the background.
        """
        self._closed.set()
        self._inbox.close()
        self._presence.wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(CLOSE_S)

    # --- in the listener's own thread

    def _run(self) -> None:
        with zenoh_call():
            self._receive()
        atexit.unregister(self.close)

    def _receive(self) -> None:
        session = self._link.await_session(self._closed)
        if session is not None:
            hearing = Subscriptions(session, self._link.threads, self._robots, self._key_prefix)
            requests = Requests(session)
            try:
                self._declare(hearing, requests)
            except RuntimeError as error:  # no thread can start: the program ends
                log.warning('cannot receive from %s: %s', self.name, error)
                self._closed.set()
            while not self._closed.is_set():
                for robot, here in self._presence.await_news(self._closed, _TICK_S):
                    self._notify(robot, here)
                self._logs.write_counts()
            requests.close()
            self._link.close()

    def _declare(self, hearing: Subscriptions, requests: Requests) -> None:
        reception = Reception(
            self._welcome, self._roster, self._inbox, requests.add, self._logs.warnings)
        max_age_s = (None if self._cache_time >= UNLIMITED
                     else self._cache_time / NANOSECONDS_PER_SECOND)

        def hear_token(key: str, here: bool) -> None:
            topic = self._note_token(key, here)
            if topic is not None and here:
                requests.repeat(topic.robot)
                if topic.static:
                    requests.ask_old_cache(topic.robot, key, reception.receive_from)

        decoder = TransformDecoder(self._place_of, self._roster, self._logs)
        self._link.threads.start(lambda: decoder.decode_all(self._inbox), 'decoder')
        self._link.threads.start(requests.work, 'answers')
        hearing.subscribe_tokens(hear_token)
        hearing.subscribe_transforms(True, None, reception.receive, self._roster.miss)
        hearing.subscribe_transforms(False, max_age_s, reception.receive, self._roster.miss)

    def _notify(self, robot: str, here: bool) -> None:
        """Record that a robot has appeared or gone, and call ``on_robot``, which may raise."""
        self._roster.appear(robot) if here else self._roster.leave(robot)
        if self._on_robot is not None:
            try:
                self._on_robot(robot, here)
            except Exception:  # noqa: B902 - a user's callback may raise anything
                self._logs.failures.report('on_robot', robot)

    # --- in threads for Zenoh's deliveries

    def _note_token(self, key: str, here: bool) -> Topic | None:
        """Record that a token has appeared or gone; return its topic, if the robot is selected."""
        topic = topic_of_token(key, self._key_prefix)
        if topic is None:
            self._warn_of_bridge(key)
            return None
        if not self._admit(topic.robot):
            return None
        if here:
            self._roster.reconnect(topic.robot)
            self._presence.see(topic.robot, key)
        elif self._presence.miss(topic.robot, key):
            self._roster.disconnect(topic.robot)
        return topic

    def _warn_of_bridge(self, token: str) -> None:
        """Warn once of a bridge without a namespace, whose robot has no name."""
        if not self._warned_of_bridge and is_nameless_bridge(token, self._key_prefix):
            self._warned_of_bridge = True
            key = f'{self._key_prefix}/tf'.removeprefix('/')
            log.warning('a zenoh-bridge-ros2dds sends transforms under the key %r, which names no '
                        'robot, so they are ignored: start it with --namespace /robot7', key)

    def _welcome(self, key: str) -> Topic | None:
        """Return the topic of a key; None: the listener does not receive it."""
        topic = topic_of(key, self._key_prefix)
        if topic is None or not self._admit(topic.robot):
            return None
        if topic.robot not in self._heard:
            self._heard.add(topic.robot)
            self._presence.see(topic.robot)
        return topic

    def _admit(self, robot: str) -> bool:
        if self._roster.knows(robot):
            return True
        if not any(pattern.includes(robot) for pattern in self._wanted):
            return False
        admitted, report = self._roster.admit(robot)
        if report is not None:
            self._logs.warnings.write(*report)
        return admitted

    def _place_of(self, robot: str) -> RobotPlace:
        if self._separate:
            return RobotPlace(self._buffer_of(robot), as_published, frozenset())
        return RobotPlace(self.buffer, names_below(robot, self._shared), self._shared)

    def _buffer_of(self, robot: str) -> BufferCore:
        with self._buffers_lock:
            if robot not in self._buffers:
                buffer = self._buffers[robot] = BufferCore(
                    self._cache_time, now=time.time_ns,
                    max_frames=DEFAULT_MAX_FRAMES if self._separate else _MAX_FRAMES)
                for observer in self._observers:
                    buffer.observers.add(observer)
            return self._buffers[robot]


def _checked_robots(robots: str | Collection[str]) -> list[str]:
    patterns = [check_robots(name) for name in one_or_several(robots)]
    if not patterns:
        raise FleetError("no robots are selected: robots='*' selects all")
    return patterns


def _checked_callback(on_robot: _OnRobot | None) -> _OnRobot | None:
    if on_robot is not None and not callable(on_robot):
        raise FleetError(f'on_robot has to be a function of a name and a bool, not {on_robot!r}')
    return on_robot
