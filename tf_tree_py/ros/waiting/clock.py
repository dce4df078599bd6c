# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waits by a ROS clock, which may stand still, run at its own pace, or jump back."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import threading
import time
import weakref

from rclpy.clock import Clock, ClockChange, JumpHandle, JumpThreshold, ROSClock, TimeJump
from rclpy.context import Context
from rclpy.duration import Duration
import rclpy.logging
from tf_tree_py.core import fork_locks
from tf_tree_py.core.stamp import as_seconds, format_stamp

from ..threads.internal_node import is_running

# After so many seconds without a tick, a wait by a simulated clock is reported.
STOPPED_S = 3.0

_NO_LISTENER = 'Given up: the listener was closed, or ROS was shut down'

_EVERY_TICK = JumpThreshold(min_forward=Duration(nanoseconds=1),
                            min_backward=Duration(nanoseconds=-1))


class ClockWatch:
    """
    The clock that a buffer follows, and the waits that it ends.

    Clocks are added and removed with the nodes that drive them; the newest one is in use. All
    waits share one jump callback: rclpy iterates over a clock's callbacks by index, so a removal
    during a tick makes it skip another callback.
    """

    def __init__(self, on_jump_back: Callable[[TimeJump], None]) -> None:
        self._on_jump_back = on_jump_back
        self._lock = fork_locks.lock()
        self._clocks: list[tuple[Clock, Context | None]] = []
        self._clock: tuple[Clock | None, Context | None] = (None, None)
        self._handles: list[JumpHandle] = []
        # A clock has only a raw pointer to its jump handle, which ends with this object.
        weakref.finalize(self, _unregister, self._handles).atexit = False
        self._sleepers: dict[Callable[[], None], float] = {}
        self.simulated = False
        """Whether the time comes from ``/clock`` and not from the system."""
        self.released = 0
        """How often ``release`` was called."""
        self.may_report = True
        """Whether ``report_if_stopped`` has not reported anything yet."""
        fork_locks.repair(self)

    def repair_in_child(self) -> None:
        """Forget the waits of the parent process."""
        self._sleepers.clear()

    def use_clock(self, clock: Clock, context: Context | None = None) -> None:
        """Follow a clock from now on, as long as the context that drives it is alive."""
        with self._lock:
            self._clocks.append((clock, context))
            self._attend()

    def leave(self, clock: Clock, context: Context | None = None) -> None:
        """Stop following a clock, and use the one before it again, if there is one."""
        with self._lock:
            self._clocks.remove((clock, context))
            self._attend()

    @property
    def clock(self) -> Clock | None:
        """Return the clock in use; None if there is none."""
        return self._clock[0]

    def simulated_now(self) -> int | None:
        """Return the simulated time in nanoseconds; None when time is not simulated."""
        clock, context = self._clock
        if clock is None or not _is_simulated(clock):
            return None
        # After its context has ended, the clock would never advance.
        return clock.now().nanoseconds if context is None or is_running(context) else None

    def has_ended(self) -> bool:
        """Return whether the clock in use has left, or has ended with its context."""
        clock, context = self._clock
        return clock is None or (context is not None and not is_running(context))

    @contextmanager
    def waking(self, wake: Callable[[], None], end: float) -> Iterator[None]:
        """Call ``wake`` when the simulated time reaches the end, or another clock is in use."""
        self._sleepers[wake] = end
        try:
            yield
        finally:
            del self._sleepers[wake]

    def release(self) -> None:
        """End every wait that has begun."""
        self.released += 1
        self._wake_until(math.inf)

    def report_if_stopped(self, before: int | None) -> None:
        """
        Log once that waits end only when simulated time goes on.

        :param before: the simulated time ``STOPPED_S`` ago.
        """
        if self.may_report and before is not None and self.simulated_now() == before:
            self.may_report = False
            rclpy.logging.get_logger('tf_tree_py').warning(
                f'A lookup waits for simulated time, which has stood still at '
                f'{format_stamp(before)} s for {STOPPED_S:.0f} s: is any node publishing /clock? '
                'Its timeout does not pass in the meantime. Buffer(wall_guard=Duration(seconds=5))'
                ' limits such a wait')

    def _attend(self) -> None:
        """Use the newest clock, and receive jumps from that one only."""
        _unregister(self._handles)
        self._clock = self._clocks[-1] if self._clocks else (None, None)
        clock = self._clock[0]
        self.simulated = _is_simulated(clock)
        if clock is not None:
            self._handles.append(clock.create_jump_callback(
                _EVERY_TICK, post_callback=_weakly(self._on_tick)))
        self._wake_until(math.inf)

    def _on_tick(self, jump: TimeJump) -> None:
        if jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE:
            # Another thread may be replacing this clock.
            with self._lock:
                self.simulated = _is_simulated(self._clock[0])
        clock = self._clock[0]
        try:
            if jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE or jump.delta.nanoseconds < 0:
                self._on_jump_back(jump)
        finally:
            if self._sleepers and clock is not None:
                self._wake_until(clock.now().nanoseconds)

    def _wake_until(self, time: float) -> None:
        for wake, end in list(self._sleepers.items()):
            if end <= time:
                wake()


class ClockDeadline:
    """
    A timeout by the clock that a buffer follows.

    With simulated time it follows ``/clock``, and does not pass while that stands still; the log
    reports this once. Otherwise it follows the monotonic system clock. Nothing polls.

    :ivar why_early: why the wait ended before its timeout; '' if it did not.
    """

    def __init__(self, watch: ClockWatch, timeout: int, wall_guard_s: float | None, *,
                 by_wall: bool = False) -> None:
        """
        Begin now.

        :param timeout: nanoseconds of the clock.
        :param wall_guard_s: with simulated time, the longest wait in seconds of wall time;
            None: without a limit.
        :param by_wall: follow the monotonic system clock also with simulated time.
        """
        self.why_early = ''
        self._watch = watch
        self._released = watch.released
        self._wall_begin = time.monotonic()
        self._begin = self._now = None if by_wall else watch.simulated_now()
        wall_s = as_seconds(timeout) if self._begin is None else wall_guard_s
        self._wall_end = None if wall_s is None else self._wall_begin + wall_s
        self._end = math.inf if self._begin is None else self._begin + timeout

    def wait(self, event: threading.Event) -> bool:
        """Block until the event is set (True) or the time is over (False)."""
        with self._watch.waking(event.set, self._end):
            if self._is_over():
                return event.is_set()
            if (self._begin is not None and self._watch.may_report
                    and self._left_s() > STOPPED_S):
                if event.wait(STOPPED_S):
                    return True
                self._watch.report_if_stopped(self._begin)
            if self._wall_end is None:
                return event.wait()
            if event.wait(self._left_s()):
                return True
            if self._begin is not None:
                self.why_early = (f'Given up after {time.monotonic() - self._wall_begin:.3f} s of '
                                  'wall time, the wall_guard: is any node publishing /clock?')
            return False

    def _left_s(self) -> float:
        """Return the seconds that may be waited by the wall clock."""
        if self._wall_end is None:
            return threading.TIMEOUT_MAX
        return min(max(0.0, self._wall_end - time.monotonic()), threading.TIMEOUT_MAX)

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began, of simulated time where that is in use."""
        if self._begin is None or self._now is None:
            return time.monotonic() - self._wall_begin
        return as_seconds(self._now - self._begin)

    def _is_over(self) -> bool:
        if self._watch.released != self._released:
            self.why_early = _NO_LISTENER
            return True
        if self._begin is None:
            return False
        self._now = self._watch.simulated_now()
        if self._now is None and self._watch.has_ended():
            # The listener that releases all waits may only notice this later.
            self.why_early = _NO_LISTENER
        return self._now is None or self._now >= self._end


def _is_simulated(clock: Clock | None) -> bool:
    return isinstance(clock, ROSClock) and clock.ros_time_is_active


def _unregister(handles: list[JumpHandle]) -> None:
    while handles:
        handles.pop().unregister()


def _weakly(method: Callable[[TimeJump], None]) -> Callable[[TimeJump], None]:
    """Return a method as a function that does not keep its object alive."""
    reference = weakref.WeakMethod(method)

    def call(jump: TimeJump) -> None:
        alive = reference()
        if alive is not None:
            alive(jump)

    return call
