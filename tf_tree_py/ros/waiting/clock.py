# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The ROS clock of a buffer, which may stand still, run at its own pace, tremble, or jump.

It decides when time has started anew, and when simulated time has reached the end of a wait.

The rules:

- A tick runs in the thread that takes ``/clock``, or sets ``use_sim_time``, within rclpy. It calls
  ``on_jump_back`` and ``on_younger`` without a lock, because these take the buffer's and wake the
  waiters.
- Another thread may replace the clock at any moment, also during a tick. So ``_followed`` is read
  once, without the lock, and a tick of another clock than that is ignored.
- ``Timed.reach``, ``Timed.start`` and what ``waking`` calls take no lock: those of this file may
  be held.
- A wait is added in the same step in which the clock is read, so no tick is missed in between.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import heapq
import itertools
import time
from typing import NamedTuple, Protocol
import weakref

from rclpy.clock import Clock, ClockChange, JumpHandle, JumpThreshold, ROSClock, TimeJump
from rclpy.context import Context
from rclpy.duration import Duration
import rclpy.logging
from tf_tree_py.core import fork_locks
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds
from tf_tree_py.core.text import listed

from ..threads.internal_node import is_running

# After so many seconds without a tick, a wait by a simulated clock is reported.
STOPPED_S = 3.0

JUMP_BACK = from_seconds(1.0)
"""A step back of this much or more begins another run; the limit of tf2_ros."""

_EVERY_TICK = JumpThreshold(min_forward=Duration(nanoseconds=1),
                            min_backward=Duration(nanoseconds=-1))
# So many steps back in so many seconds are more than a restart, or a message out of order.
_TO_AND_FRO, _TO_AND_FRO_S = 3, 5.0
_FEW_ENDS = 64


class RosClock(NamedTuple):
    """
    A clock, and what is known of it.

    :ivar context: the context that drives it; None: it advances without one.
    :ivar publishers: returns the nodes that publish its time, by the ROS graph.
    """

    clock: Clock
    context: Context | None = None
    publishers: Callable[[], Sequence[str]] = list


class _Followed:
    """
    A clock while it is in use.

    :ivar newest: the newest time that it has shown, nanoseconds.
    """

    def __init__(self, clock: RosClock) -> None:
        self.clock = clock
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget which times it has shown before."""
        self.newest = self.now() or 0

    def now(self) -> int | None:
        """Return the simulated time; None: it is not simulated, or its context has ended."""
        clock = self.clock.clock
        if not is_simulated(clock):
            return None
        # After its context has ended, the clock would never advance.
        return None if self.has_ended() else clock.now().nanoseconds

    def has_ended(self) -> bool:
        """Return whether its context has ended."""
        context = self.clock.context
        return context is not None and not is_running(context)


class Timed(Protocol):
    """Something that ends at a simulated time; the reference to it is weak."""

    def start(self, now: int) -> None:
        """Begin now, because the first time has been received."""

    def reach(self, now: int | None) -> None:
        """Take note that the time has come; None: simulated time is no longer received."""


class ClockWatch:
    """
    The clock that a buffer follows, and the waits that it ends.

    Clocks are added and removed with the nodes that drive them; the newest one is in use. All
    waits share one jump callback: rclpy iterates over a clock's callbacks by index, so a removal
    during a tick makes it skip another callback.

    A clock with several publishers trembles: it steps back by a little at every other message.
    So a step back counts from the newest time that the clock has shown, and a wait ends at the
    first tick that reaches its end, even if the clock steps back right after it.
    """

    def __init__(self, on_jump_back: Callable[[TimeJump], None],
                 jump_back: int = JUMP_BACK) -> None:
        """
        Begin without a clock.

        :param on_jump_back: called if time has started anew; the jump's ``delta`` is from the
            newest time that the clock had shown.
        :param jump_back: how far the clock has to step back for that, nanoseconds; 0: any step.
        """
        self._on_jump_back = on_jump_back
        self._jump_back = max(jump_back, 1)
        self._lock = fork_locks.lock()
        self._clocks: list[RosClock] = []
        self._followed: _Followed | None = None
        self._handles: list[JumpHandle] = []
        # A clock has only a raw pointer to its jump handle, which ends with this object.
        weakref.finalize(self, _unregister, self._handles).atexit = False
        self._sleepers: set[Callable[[], None]] = set()
        self._ends = _Ends()
        # When the clock stepped back lately, by the monotonic clock; None: no longer of interest.
        self._steps_back: list[float] | None = []
        self.simulated = False
        """Whether the time comes from ``/clock`` and not from the system."""
        self.released = 0
        """How often ``release`` was called."""
        self.on_younger: Callable[[], object] = lambda: None
        """Called when time has begun, or stepped back a little: what was too old may be fresh."""
        self.may_report = True
        """Whether ``report_if_stopped`` has not reported anything yet."""
        fork_locks.repair(self)

    def repair_in_child(self) -> None:
        """Forget the waits of the parent process."""
        self._sleepers.clear()

    def use_clock(self, clock: RosClock) -> None:
        """Follow a clock from now on, as long as the context that drives it is alive."""
        with self._lock:
            self._clocks.append(clock)
            self._attend()

    def leave(self, clock: RosClock) -> None:
        """Stop following a clock, and use the one before it again, if there is one."""
        with self._lock:
            self._clocks.remove(clock)
            self._attend()

    @property
    def clock(self) -> Clock | None:
        """Return the clock in use; None if there is none."""
        followed = self._followed  # read once: another thread may replace it
        return None if followed is None else followed.clock.clock

    def simulated_now(self) -> int | None:
        """Return the simulated time in nanoseconds; None when time is not simulated."""
        followed = self._followed
        return None if followed is None else followed.now()

    def has_ended(self) -> bool:
        """Return whether the clock in use has left, or has ended with its context."""
        followed = self._followed
        return followed is None or followed.has_ended()

    # --- waits

    def begin(self, timed: Timed, timeout: int | None) -> int | None:
        """
        Begin a wait that ends when simulated time has advanced by a timeout.

        :param timeout: nanoseconds; None: no limit.
        :return: the simulated time; None: time is not simulated, and ``reach`` is not called.
        """
        return self._ends.add(timed, self.simulated_now, timeout)

    @contextmanager
    def waking(self, wake: Callable[[], None]) -> Iterator[None]:
        """Call ``wake`` when every wait ends."""
        self._sleepers.add(wake)
        try:
            yield
        finally:
            self._sleepers.remove(wake)

    def release(self) -> None:
        """End every wait that has begun."""
        self.released += 1
        self._ends.reach(None)
        for wake in list(self._sleepers):
            wake()

    def report_if_stopped(self, before: int | None) -> None:
        """
        Log once that waits end only when simulated time goes on.

        :param before: the simulated time ``STOPPED_S`` ago.
        """
        if self.may_report and before is not None and self.simulated_now() == before:
            self.may_report = False
            _warn('A lookup waits for simulated time, which has stood still at '
                  f'{format_stamp(before)} s for {STOPPED_S:.0f} s: is any node publishing '
                  '/clock? Its timeout does not pass in the meantime. '
                  'Buffer(wall_guard=Duration(seconds=5)) limits such a wait')

    # --- ticks

    def _attend(self) -> None:
        """Use the newest clock, and receive jumps from that one only."""
        _unregister(self._handles)
        followed = self._followed = _Followed(self._clocks[-1]) if self._clocks else None
        self.simulated = is_simulated(self.clock)
        if followed is not None:
            self._handles.append(followed.clock.clock.create_jump_callback(
                _EVERY_TICK, post_callback=_weakly(self._on_tick, followed)))
        self._ends.reach(self.simulated_now())

    def _on_tick(self, jump: TimeJump, followed: _Followed) -> None:
        if followed is not self._followed:
            return  # Another thread has just replaced it.
        changed = jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE
        if changed:
            with self._lock:
                self.simulated = is_simulated(self.clock)
        now = followed.now()
        try:
            if changed:
                followed.begin_anew()
                self._on_jump_back(jump)
            elif now is not None:
                self._compare(now, followed, jump)
        finally:
            self._ends.reach(now)
            # Last, because it may query the graph.
            if jump.delta.nanoseconds < 0:  # a switch of the kind of time is no step
                self._name_publishers(followed.clock, -jump.delta.nanoseconds)

    def _compare(self, now: int, followed: _Followed, jump: TimeJump) -> None:
        """Compare the time with the newest one that the clock has shown."""
        back = followed.newest - now
        if back < self._jump_back:
            is_younger = back > 0 or followed.newest <= 0
            followed.newest = max(followed.newest, now)
            if is_younger:
                self.on_younger()
        else:
            followed.newest = now
            self._on_jump_back(TimeJump(jump.clock_change, Duration(nanoseconds=-back)))

    def _name_publishers(self, clock: RosClock, back: int) -> None:
        """
        Log once which nodes publish the time, if there are several and it goes to and fro.

        A simulation that is restarted steps back once, and stays in the graph for a while.
        """
        wall_now = time.monotonic()
        if self._steps_back is None:
            return
        self._steps_back = [each for each in self._steps_back
                            if each > wall_now - _TO_AND_FRO_S] + [wall_now]
        if len(self._steps_back) < _TO_AND_FRO:
            return
        self._steps_back = []
        # A node that was restarted stays in the graph for a while, under the same name.
        names = sorted(set(clock.publishers()))
        if len(names) > 1:
            self._steps_back = None
            _warn(f'/clock went back by {format_span(back)}, and {len(names)} nodes publish it: '
                  f'{listed(names)}. Time goes to and fro between them: stop all but one')


class _Ends:
    """
    The simulated times at which waits end, the earliest first.

    An end is removed at the first tick that reaches it. A wait that begins is added in the same
    step in which the clock is read, so no tick is missed between the two.
    """

    def __init__(self) -> None:
        # Re-entrant, because a garbage collection may run a user's finalizer in here.
        self._lock = fork_locks.rlock()
        self._heap: list[tuple[int, int, weakref.ref[Timed]]] = []
        # The waits that have begun before the first time was received, with their timeouts.
        self._not_started: list[tuple[int, weakref.ref[Timed]]] = []
        self._numbers = itertools.count()
        self._most = _FEW_ENDS

    def add(self, timed: Timed, now: Callable[[], int | None], timeout: int | None) -> int | None:
        with self._lock:
            begin = now()
            if begin is not None and timeout is not None:
                if len(self._heap) + len(self._not_started) >= self._most:
                    self._remove_dead()
                reference = weakref.ref(timed)
                if begin > 0:
                    self._push(begin + timeout, reference)
                else:
                    self._not_started.append((timeout, reference))
            return begin

    def _push(self, end: int, reference: 'weakref.ref[Timed]') -> None:
        heapq.heappush(self._heap, (end, next(self._numbers), reference))

    def _remove_dead(self) -> None:
        """Remove waits that were answered before their end; O(1) for each wait, amortised."""
        self._heap = [entry for entry in self._heap if entry[2]() is not None]
        heapq.heapify(self._heap)
        self._not_started = [entry for entry in self._not_started if entry[1]() is not None]
        self._most = max(2 * (len(self._heap) + len(self._not_started)), _FEW_ENDS)

    def _start(self, now: int) -> None:
        """Begin the waits that have begun before the first time was received."""
        for timeout, reference in self._not_started:
            timed = reference()
            if timed is not None:
                timed.start(now)
                self._push(now + timeout, reference)
        self._not_started = []

    def reach(self, now: int | None) -> None:
        """Notify the waits that end at a time or before; None: all of them."""
        due = []
        with self._lock:
            if now is None:
                due += [reference for _, reference in self._not_started]
                self._not_started = []
            elif now > 0 and self._not_started:
                self._start(now)
            while self._heap and (now is None or self._heap[0][0] <= now):
                due.append(heapq.heappop(self._heap)[2])
        for reference in due:
            timed = reference()
            if timed is not None:
                timed.reach(now)


def _warn(line: str) -> None:
    rclpy.logging.get_logger('tf_tree_py').warning(line)


def is_simulated(clock: Clock | None) -> bool:
    """Return whether a clock shows simulated time."""
    return isinstance(clock, ROSClock) and clock.ros_time_is_active


def _unregister(handles: list[JumpHandle]) -> None:
    while handles:
        handles.pop().unregister()


def _weakly(method: Callable[[TimeJump, _Followed], None],
            followed: _Followed) -> Callable[[TimeJump], None]:
    """Return a method as a function of a jump that does not keep its object alive."""
    reference = weakref.WeakMethod(method)

    def call(jump: TimeJump) -> None:
        alive = reference()
        if alive is not None:
            alive(jump, followed)

    return call
