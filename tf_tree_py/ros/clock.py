"""Waiting by a ROS clock, which may stand still, run at its own pace, or jump back."""

import threading
import time

from rclpy.clock import Clock, JumpHandle, JumpThreshold, ROSClock
from rclpy.duration import Duration
from tf_tree_py.core.deadline import Deadline, WallDeadline
from tf_tree_py.core.stamp import as_seconds

_EVERY_TICK = JumpThreshold(min_forward=Duration(nanoseconds=1),
                            min_backward=Duration(nanoseconds=-1))


class SimDeadline:
    """
    A timeout by a simulated clock: as long as ``/clock`` stands still, so does it.

    Every tick of the clock wakes the waiter; nothing is polled.
    """

    def __init__(self, clock: Clock, timeout: int, wall_guard_s: float | None) -> None:
        """
        Begin now.

        :param timeout: nanoseconds of the clock.
        :param wall_guard_s: give up after so many seconds of wall time whatever the
            clock does; None: never.
        """
        self._clock = clock
        self._begin = clock.now().nanoseconds
        self._end = self._begin + timeout
        self._guard = None if wall_guard_s is None else time.monotonic() + wall_guard_s

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set or the clock ticked (True), or time is up (False)."""
        with self._wake_on_tick(event):
            if self._clock.now().nanoseconds >= self._end:
                return event.is_set()
            if self._guard is None:
                return event.wait()
            return event.wait(max(0.0, self._guard - time.monotonic()))

    def elapsed_s(self) -> float:
        """Return the seconds of the clock since the wait began."""
        return as_seconds(self._clock.now().nanoseconds - self._begin)

    def _wake_on_tick(self, event: threading.Event) -> JumpHandle:
        return self._clock.create_jump_callback(_EVERY_TICK, post_callback=lambda _: event.set())


def deadline(clock: Clock | None, timeout: int, wall_guard_s: float | None) -> Deadline:
    """Return the deadline that a clock asks for: simulated time if it has that, else the wall."""
    if isinstance(clock, ROSClock) and clock.ros_time_is_active:
        return SimDeadline(clock, timeout, wall_guard_s)
    return WallDeadline(as_seconds(timeout))
