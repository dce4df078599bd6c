# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A lookup of the latest at a buffer server that refuses a transform that is too old.

A goal has no field for that, so the client compares the stamp. It does not ask a server again and
again for the latest: it asks for the oldest stamp that is allowed, which the server awaits, and
then for the latest.
"""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import TransformStamped
from tf_tree_py.beyond.freshness.ages import stale, StaleException
from tf_tree_py.core.errors import ExtrapolationException, TimeoutException, TransformException
from tf_tree_py.core.stamp import LATEST

from .lookup_goal import LookupCall
from ..messages.convert import as_nanoseconds, time_message


class FreshCall(LookupCall):
    """A future of the latest ``TransformStamped`` that a server finds, if it is not too old."""

    def __init__(self, *call: Any, max_age: int, now: Callable[[], int]) -> None:
        """
        Store the goal.

        :param call: the arguments of ``LookupCall``.
        :param max_age: how old the transform may be, nanoseconds.
        :param now: the clock that the stamps follow, nanoseconds; 0: it has not started.
        """
        super().__init__(*call)
        self._max_age, self._now = max_age, now
        self._stamp: int | None = None  # of a transform that was too old
        self._awaits = False

    def _is_answer(self, transform: TransformStamped) -> bool:
        goal = self._goal
        if self._awaits:  # the server has a newer one now
            self._awaits, goal.source_time = False, time_message(LATEST)
            return False
        now, stamp = self._now(), as_nanoseconds(transform.header.stamp)
        # If all edges are static, there is no stamp.
        if (stamp == LATEST or goal.target_frame == goal.source_frame
                or (now > 0 and now - stamp <= self._max_age)):
            return True
        self._stamp = stamp
        if now <= 0 or self.left_s() <= 0.0:
            raise self._stale()
        self._awaits, goal.source_time = True, time_message(now - self._max_age)
        return False

    def _reason(self, error: TransformException) -> TransformException:
        is_late = isinstance(error, ExtrapolationException | TimeoutException)
        return error if self._stamp is None or not is_late else self._stale()

    def _stale(self) -> StaleException:
        assert self._stamp is not None
        target_frame, source_frame = self._goal.target_frame, self._goal.source_frame
        error = stale(self._stamp, self._now(), self._max_age)
        if error.age is not None:
            error.hint = (f'tf_echo {target_frame} {source_frame} --once --explain shows the age '
                          'of each edge between them')
        error.in_lookup(target_frame, source_frame, True)
        if self._timeout_s > 0.0:
            error.waited_s = time.monotonic() - self._begin
        return error
