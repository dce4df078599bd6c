"""Hears a fleet, and fills a buffer."""

import atexit
from collections.abc import Callable, Collection, Sequence
import threading
import time
from typing import Final

from tf_tree_py.core.arrivals.frame_names import as_published
from tf_tree_py.core.arrivals.incident_log import IncidentLog
from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.buffer.buffer_core import BufferCore, DEFAULT_CACHE_TIME, DEFAULT_MAX_FRAMES
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND, UNLIMITED
from tf_tree_py.core.text import shorten
from tf_tree_py.core.times import checked_cache_time

from .errors import FleetError
from .feed import Feed, Place
from .hearing import Hearing
from .keys import check_prefix, check_robot, check_robots, Topic, topic_of, topic_of_token
from .link import Link
from .listening import log, Threads
from .presence import Presence
from .roster import Robot, Roster
from .session import (
    configuration,
    Connect,
    endpoints_of,
    needs_zenoh,
    one_or_several,
    PathLike,
)
from .trust import checked_shared, names_below

OnRobot = Callable[[str, bool], object]

# Frames of a whole fleet in one buffer.
_MAX_FRAMES: Final = 200_000
# Robots that are told not to be heard; whoever may write any key may invent more.
_MOST_NOT_HEARD: Final = 20
# No robot is called so.
_ALL: Final = ''


class FleetListener:
    """
    Fills a buffer with what robots send over Zenoh; needs no ROS.

    Every robot's frames get its name in front, ``robot7/base_link``, but for those that all
    share. It reads in threads of its own, so lookups that wait work anywhere. It connects,
    and connects again, by itself, and may be made before there is a router.

    It lives until ``close()``; it is a context manager.

    :ivar name: what it is connected to, for people.
    """

    def __init__(self, connect: Connect | None = None, robots: str | Collection[str] = '*', *,
                 shared_frames: Collection[str] = ('map',), separate: bool = False,
                 cache_time: int | None = None, config: PathLike | None = None,
                 key_prefix: str = '', on_robot: OnRobot | None = None,
                 observers: Sequence[Observer] = ()) -> None:
        """
        Begin to listen.

        :param connect: a router, such as ``tcp/hall:7447``, or several; None: as ``config``
            says.
        :param robots: which: a name, or a pattern such as ``robot*``; or several. ``*`` is
            anything but a slash, and ``**`` alone anything.
        :param shared_frames: keep their name. A robot may hang its frames below them, and not
            hang them elsewhere.
        :param separate: fill a buffer for each robot, ``listener['robot7']``, with frames as the
            robot calls them.
        :param cache_time: how much history each edge keeps, nanoseconds; 10 s unless given.
        :param config: a configuration file of Zenoh: TLS, user and password, and all else.
        :param key_prefix: what stands in front of the robots' names in keys.
        :param on_robot: called with a robot's name and whether it is there, when it comes and
            when it goes; in a thread of the listener's own, which ``close()`` waits for.
        :param observers: watch every buffer, from the first message on.
        :raises FleetError: Zenoh is not installed, or an argument cannot be.
        """
        self._robots = [check_robots(name) for name in one_or_several(robots)]
        if not self._robots:
            raise FleetError("no robots are to be heard: robots='*' is all")
        self._key_prefix = check_prefix(key_prefix)
        self._shared = checked_shared(shared_frames)
        self._cache_time = (DEFAULT_CACHE_TIME if cache_time is None
                            else checked_cache_time(cache_time))
        self._separate = separate
        made = configuration(connect, config)
        self.name = ', '.join(endpoints_of(made))
        self._wanted = [needs_zenoh().KeyExpr(pattern) for pattern in self._robots]
        if on_robot is not None and not callable(on_robot):
            raise FleetError(f'on_robot is a function of a name and a bool, not {on_robot!r}')
        self._on_robot = on_robot
        self._observers = observers
        self._buffers_lock = threading.Lock()
        self._buffers: dict[str, BufferCore] = {}
        self._roster = Roster(apart=not separate)
        self._presence = Presence(time.monotonic)
        self._incidents = IncidentLog(log.getChild('incidents'))
        self._not_heard = 0
        self._closed = threading.Event()
        self._threads = Threads(needs_zenoh().handlers.FifoChannel)
        self._link = Link(made, self.name, self._threads, self._presence.connect)
        self._thread = threading.Thread(target=self._run, name='fleet', daemon=True)
        # Zenoh aborts the process where the interpreter ends under one of its calls.
        atexit.register(self.close)
        self._thread.start()

    # --- what there is

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
        Return the buffer of a robot, which need not be there yet.

        :raises FleetError: there is one buffer for all, or no robot can have that name.
        """
        if not self._separate:
            raise FleetError('all robots are in listener.buffer; separate=True gives each its own')
        return self._buffer_of(check_robot(robot))

    def robots(self) -> list[Robot]:
        """Return all robots that were heard of, by name, those too that have gone."""
        return self._roster.robots()

    @property
    def connected(self) -> bool:
        """Return whether there is a connection just now."""
        return self._presence.connected

    def close(self) -> None:
        """
        Stop listening; what is in the buffers stays there.

        Where there is no router, this waits for the present attempt: two seconds at most.
        """
        self._closed.set()
        self._presence.wake()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def __enter__(self) -> 'FleetListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- in the listener's own thread

    def _run(self) -> None:
        session = self._link.await_session(self._closed)
        if session is not None:
            hearing = Hearing(session, self._threads, self._robots, self._key_prefix)
            try:
                self._declare(hearing)
            except RuntimeError as error:  # no thread can be started: the program ends, say
                log.warning('%s is not listened to: %s', self.name, error)
                self._closed.set()
            while not self._closed.is_set():
                for robot, here in self._presence.await_news(self._closed):
                    self._tell(robot, here)
            hearing.close()
            self._link.close()
            self._threads.join()
        atexit.unregister(self.close)

    def _declare(self, hearing: Hearing) -> None:
        def new_feed() -> Feed:
            return Feed(self._welcome, self._roster, self._incidents)

        max_age_s = (None if self._cache_time >= UNLIMITED
                     else self._cache_time / NANOSECONDS_PER_SECOND)

        def hear_token(key: str, here: bool) -> None:
            topic = self._note_token(key, here)
            if topic is not None and topic.static and here:
                hearing.ask_old_cache(key, new_feed())

        hearing.hear_tokens(hear_token)
        hearing.hear_transforms(True, None, new_feed, self._roster.miss)
        hearing.hear_transforms(False, max_age_s, new_feed, self._roster.miss)

    def _tell(self, robot: str, here: bool) -> None:
        """Tell that a robot has come or gone; what is called must not end the thread."""
        self._roster.appear(robot) if here else self._roster.leave(robot)
        if self._on_robot is not None:
            try:
                self._on_robot(robot, here)
            except Exception:  # noqa: B902 - it is a stranger's
                log.exception('on_robot(%r, %r) has raised', robot, here)

    # --- in threads that take what Zenoh delivers

    def _note_token(self, key: str, here: bool) -> Topic | None:
        """Note that a token is there or has gone; return whose it is, if it is wanted."""
        topic = topic_of_token(key, self._key_prefix)
        if topic is None or not self._admit(topic.robot):
            return None
        if here:
            self._roster.reconnect(topic.robot)
            self._presence.see(topic.robot, key)
        else:
            self._presence.miss(topic.robot, key)
        return topic

    def _welcome(self, key: str) -> tuple[Topic, Place] | None:
        """Return whose a key is, and where what comes under it goes."""
        topic = topic_of(key, self._key_prefix)
        if topic is None or not self._admit(topic.robot):
            return None
        self._presence.see(topic.robot)
        return topic, self._place_of(topic.robot)

    def _admit(self, robot: str) -> bool:
        if not any(pattern.includes(robot) for pattern in self._wanted):
            return False
        why_not = self._roster.admit(robot)
        if why_not and self._not_heard < _MOST_NOT_HEARD:
            self._not_heard += 1
            log.warning('the robot %r is not heard: %s', shorten(robot, 80), why_not)
        return not why_not

    def _place_of(self, robot: str) -> Place:
        if self._separate:
            return Place(self._buffer_of(robot), as_published, frozenset())
        return Place(self.buffer, names_below(robot, self._shared), self._shared)

    def _buffer_of(self, robot: str) -> BufferCore:
        with self._buffers_lock:
            if robot not in self._buffers:
                buffer = self._buffers[robot] = BufferCore(
                    self._cache_time, now=time.time_ns,
                    max_frames=DEFAULT_MAX_FRAMES if self._separate else _MAX_FRAMES)
                for observer in self._observers:
                    buffer.observers.add(observer)
            return self._buffers[robot]
