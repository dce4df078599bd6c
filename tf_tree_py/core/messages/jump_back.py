# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps that jump back without a clock jump: a looping bag, a restarted simulation."""

from collections.abc import Mapping, Sequence

from .incidents import Incident, Kind
from ..edges.protocol import History
from ..stamp import format_span, from_seconds

WHY_OLD = ('A bag that loops, a simulation that was restarted, or a second publisher whose clock '
           'is slow')
CURE = ('For the first two set use_sim_time and publish /clock, or pass '
        'Buffer(clear_on_jump_back=...)')

_PATIENCE = from_seconds(1.0)


class JumpBack:
    """
    Recognises a new run by its stamps alone.

    Nothing else may be mistaken for a new run, so all of these conditions must hold:

    - Stamps are behind the newest stamp in the buffer by more than the limit, and all
      messages that arrive have such stamps. (If one publisher's clock is slow, messages of
      the others still arrive.)
    - More than half of the edges that were alive (with data inside the limit) have such
      stamps. (An edge that was always behind does not count.)
    - The stamps of each of these edges advance for a second, in steps of no more than the
      limit. (Late messages do not advance, nor does a stamp that is sent repeatedly. A late
      message of the previous run, just before or after a new one begins, is not a step.)

    If the old run continues after all, there was no new run: two publishers of the same
    edges disagree about the time. The second then becomes two, four, and so on, so that
    these two cannot clear the buffer alternately for ever.

    Not thread-safe: the buffer's lock protects it.
    """

    def __init__(self, limit: int) -> None:
        """
        Start without any stamp.

        :param limit: how far stamps must go back, nanoseconds. It must be longer than the
            delay of any publisher, and shorter than a run.
        """
        if limit <= 0:
            raise ValueError(f'clear_on_jump_back is {limit} ns, and must be positive')
        self._limit = limit
        self._patience = _PATIENCE
        self._given_up: int | None = None
        self.begin()

    def begin(self) -> None:
        """Start again, because the buffer was cleared."""
        self._newest: int | None = None
        # For each edge that is behind, the first and the last stamp of its steps.
        self._steps: dict[str, tuple[int, int]] = {}
        self._gone_back: set[str] = set()

    def judge(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int], authority: str,
              histories: Mapping[str, History]) -> Incident | None:
        """
        Examine a message of at least one transform.

        :param edges: (parent, child) of each of its transforms.
        :param histories: the content of the buffer, without this message.
        :return: an incident if another run has begun, after which the caller forgets all
            moving edges; otherwise None.
        """
        newest = max(stamps)
        if self._newest is None or newest >= self._newest - self._limit:
            self._go_on(newest)
            return None
        for (_, child), stamp in zip(edges, stamps, strict=True):
            if child in histories and self._has_gone_on(child, stamp):
                self._gone_back.add(child)
        if not self._most_went_back(histories):
            return None
        back = self._newest - newest
        self._given_up = self._newest
        self.begin()
        self._newest = newest
        parent, child = edges[0]
        return Incident(
            Kind.JUMP_BACK, parent, child, newest, authority,
            f'stamps went back by {format_span(back)} and continue from there: a bag that loops, '
            'or a simulation that was restarted. All moving edges were cleared')

    def _go_on(self, newest: int) -> None:
        """Take note of a message of the current run."""
        known = newest if self._newest is None else self._newest
        if self._given_up is not None and newest > self._given_up:
            if newest - known > self._limit:
                self._patience *= 2
            self._given_up = None
        self._newest = max(newest, known)
        if self._steps:
            self._steps.clear()
            self._gone_back.clear()

    def _has_gone_on(self, child: str, stamp: int) -> bool:
        first, last = self._steps.get(child, (stamp, stamp))
        if not first <= stamp <= last + self._limit:
            first = last = stamp
        self._steps[child] = first, max(last, stamp)
        return stamp - first >= self._patience

    def _most_went_back(self, histories: Mapping[str, History]) -> bool:
        if not self._gone_back or self._newest is None:
            return False
        horizon = self._newest - self._limit
        alive = {child for child, history in histories.items()
                 if not history.is_static and (history.latest_stamp or horizon - 1) >= horizon}
        return 2 * len(alive & self._gone_back) > len(alive)
