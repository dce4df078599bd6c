# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A lookup of the latest at a buffer server that refuses a transform that is too old.

A goal has no field for that, so the client compares the stamp. To wait, it asks for the oldest
stamp that is allowed, which the server awaits, and then for the latest again. That stamp may
never come, if the tree began anew, so it is awaited for a moment only. Or it is there already, if
an edge holds its newest sample; then the client pauses.
"""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import TransformStamped
from tf2_msgs.action import LookupTransform
from tf_tree_py.beyond.freshness.ages import stale, StaleException
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import LATEST

from .lookup_goal import LEASE_S, LookupCall
from ..messages.convert import as_nanoseconds, time_message

# How long a stamp is awaited, or nothing is asked, before the latest is asked for again.
_WAIT_S, _PAUSE_S = 0.25, 0.1
# How much later the answer of a server may come.
_SLACK_S = 0.1


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
        self._awaits = self._pauses = self._is_new = False

    def _answer_in(self, response: LookupTransform.Impl.GetResultService.Response
                   ) -> TransformStamped | None:
        if self._awaits:  # whatever came of it
            self._awaits = False
            self._pauses = time.monotonic() - self._sent_at < _PAUSE_S
            self._ask_for(LATEST, LEASE_S)
            return None
        try:
            transform = super()._answer_in(response)
        except TransformException:
            if self._stamp is None or self.left_s() > 0.0:
                raise
            raise self._stale() from None
        if transform is None or self._is_fresh(transform):
            return transform
        if self.left_s() <= 0.0:
            raise self._stale()
        now = self._now()
        if self._pauses or now <= 0:
            self._pauses = False
            self._due_at = min(time.monotonic() + _PAUSE_S, self._begin + self._timeout_s)
        else:
            self._awaits = True
            self._ask_for(now - self._max_age, _WAIT_S)
        return None

    def _is_fresh(self, transform: TransformStamped) -> bool:
        now, stamp = self._now(), as_nanoseconds(transform.header.stamp)
        # If all edges are static, there is no stamp.
        if (stamp == LATEST or self._goal.target_frame == self._goal.source_frame
                or (now > 0 and now - stamp <= self._max_age)):
            return True
        self._stamp = stamp
        return False

    def _ask_for(self, stamp: int, longest_s: float) -> None:
        """Let the goal be sent again for another stamp."""
        self._goal.source_time, self._longest_lease_s = time_message(stamp), longest_s
        self._is_new = True

    # --- a wait ends also if the server's clock, which may be simulated, stands still

    def is_late(self) -> bool:
        """Return whether an available server should have answered by now."""
        if self._awaits and self.accepted:
            return time.monotonic() >= self._sent_at + self._lease_s + _SLACK_S
        return super().is_late()

    def has_late_part(self) -> bool:
        """Return whether only a part of the time is over."""
        return super().has_late_part() or (self._awaits and self.accepted)

    def goal(self) -> LookupTransform.Goal:
        """Return the goal to send now; one that was awaited in vain is for the latest again."""
        if self._awaits and not self._is_new:
            self._awaits = False
            self._ask_for(LATEST, LEASE_S)
        self._is_new = False
        return super().goal()

    def _stale(self) -> StaleException:
        assert self._stamp is not None
        target_frame, source_frame, now = (
            self._goal.target_frame, self._goal.source_frame, self._now())
        error = stale(now - self._stamp if now > 0 else None, self._max_age)
        error.hint = (f'tf_echo {target_frame} {source_frame} --once --explain shows the age of '
                      'each edge between them' if now > 0 else
                      'With use_sim_time, does any node publish /clock?')
        error.in_lookup(target_frame, source_frame, True)
        if self._timeout_s > 0.0:
            error.waited_s = time.monotonic() - self._begin
        return error
