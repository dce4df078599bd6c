# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Guards against stamps that would make a buffer refuse good data as too old.

Stamps from the far future are one such fault. The other are stamps that jump back without a
clock jump, from a looping bag or a restarted simulation. The caller provides the clock.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

from .incidents import Incident, Kind
from .sample import Sample
from ..edges.protocol import History
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp, from_seconds, LATEST

FAR = from_seconds(10.0)
"""Without a limit, stamps further ahead of the clock are reported; this is tf2's window."""

_LIKELY = ("Most likely a publisher's clock is wrong (set it with chrony or NTP), or one side "
           'uses simulated time and the other does not (use_sim_time)')
_CURE = 'Buffer(max_future=...) refuses such stamps'


class FutureGuard:
    """
    Compares stamps with a clock, and reads the clock as rarely as possible.

    The clock only advances, so a stamp that was allowed at the last reading is still allowed.
    A good stamp therefore costs one comparison, and the clock is read only when a stamp is
    beyond the last limit. After the clock has jumped back, a new guard is needed:
    see ``renewed``.

    Several threads use the guard concurrently, without the buffer's lock.

    :ivar limit: stamps up to this one are good; for later ones call ``is_too_far``.
    """

    def __init__(self, now: Callable[[], int] | None, max_future: int | None) -> None:
        """
        Make a guard that has not read the clock yet.

        :param now: the clock, nanoseconds. While it returns 0 it has not started, and no
            stamp is too far ahead. None: no stamp is ever too far ahead.
        :param max_future: how far ahead of the clock a stamp may be; later stamps are
            refused. None: no stamp is refused, and stamps further ahead than ``FAR`` are
            reported.
        """
        if max_future is not None and max_future < 0:
            raise ValueError(f'max_future is {max_future} ns, and cannot be negative')
        if max_future is not None and now is None:
            raise ValueError('max_future needs a clock: pass now, such as time.time_ns')
        self._now = now
        self._max_future = max_future
        self._span = FAR if max_future is None else max_future
        self.limit = FOREVER if now is None else BEGINNING

    def renewed(self) -> 'FutureGuard':
        """Return a guard with the same limits that has not read the clock yet."""
        return FutureGuard(self._now, self._max_future)

    def now(self) -> int:
        """Return the time by the clock, nanoseconds; 0: it has not begun, or there is none."""
        return self._now() if self._now else 0

    def is_too_far(self, stamp: int) -> bool:
        """Return whether a stamp is too far ahead of the clock."""
        return stamp > self.limit and self._is_still_too_far(stamp)

    def _is_still_too_far(self, stamp: int) -> bool:
        now = self.now()
        if now <= 0:
            return False
        self.limit = now + self._span
        return stamp > self.limit

    def part(self, samples: Iterable[Sample], authority: str, histories: Mapping[str, History]
             ) -> tuple[list[Sample], list[Incident]]:
        """
        Return the samples to insert, and incidents for those that are too far ahead.

        The clock is not read again. If no sample is refused, only the first sample of an
        edge that is too far ahead is reported, not those that follow it.

        :param histories: the content of the buffer.
        """
        taken, remarks = [], []
        for sample in samples:
            far = sample.stamp > self.limit
            if far and (self._max_future is not None or not self._was_reported(sample, histories)):
                remarks.append(self._incident(sample, authority))
            if not far or self._max_future is None:
                taken.append(sample)
        return taken, remarks

    def _was_reported(self, sample: Sample, histories: Mapping[str, History]) -> bool:
        history = histories.get(sample.child)
        return history is not None and (history.newest_stamp or LATEST) > self.limit

    def _incident(self, sample: Sample, authority: str) -> Incident:
        stamp = sample.stamp
        edge = sample.parent, sample.child
        ahead = f'its stamp {format_stamp(stamp)} is {self._ahead(stamp)} ahead of the clock'
        if self._max_future is not None:
            return Incident(
                Kind.FAR_FUTURE, *edge, stamp, authority,
                f'{ahead}, and max_future allows {format_span(self._span)}. {_LIKELY}')
        return Incident(
            Kind.AHEAD_OF_CLOCK, *edge, stamp, authority,
            f'{ahead}: good data of this edge is older, and will be refused if it is older by '
            f'more than the buffer keeps. {_LIKELY}. {_CURE}')

    def why_old(self, newest: int) -> str:
        """Return why good data is older than the newest stamp of its edge, '' if not known."""
        if not self._is_still_too_far(newest):
            return ''
        return (f'The newest stamp of this edge is {self._ahead(newest)} ahead of the clock: that '
                'stamp is wrong, and good data is refused until the clock reaches it. '
                f'{_CURE}; clear() removes them')

    def _ahead(self, stamp: int) -> str:
        return format_span(stamp - (self.limit - self._span))


# --- stamps that jump back

WHY_OLD = ('A bag that loops, a simulation that was restarted, or a second publisher whose clock '
           'is slow')
CURE = ('For the first two set use_sim_time and publish /clock; or, if all edges jumped back, '
        'pass Buffer(clear_on_jump_back=...)')

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
        newest, known = max(stamps), self._newest
        if known is None or newest >= known - self._limit:
            self._go_on(newest)
            return None
        for (_, child), stamp in zip(edges, stamps, strict=True):
            if child in histories and self._has_gone_on(child, stamp):
                self._gone_back.add(child)
        if not self._most_went_back(known - self._limit, histories):
            return None
        self._given_up = known
        self.begin()
        self._newest = newest
        parent, child = edges[0]
        return Incident(
            Kind.JUMP_BACK, parent, child, newest, authority,
            f'stamps went back by {format_span(known - newest)} and continue from there: a bag '
            'that loops, or a simulation that was restarted. All moving edges were cleared')

    def _go_on(self, newest: int) -> None:
        """Take note of a message of the current run."""
        known = newest if self._newest is None else self._newest
        if self._given_up is not None and newest > self._given_up:
            if newest - known > self._limit:
                self._patience *= 2
            self._given_up = None
        self._newest = max(newest, known)
        self._steps.clear()
        self._gone_back.clear()

    def _has_gone_on(self, child: str, stamp: int) -> bool:
        first, last = self._steps.get(child, (stamp, stamp))
        if not first <= stamp <= last + self._limit:
            first = last = stamp
        self._steps[child] = first, max(last, stamp)
        return stamp - first >= self._patience

    def _most_went_back(self, horizon: int, histories: Mapping[str, History]) -> bool:
        if not self._gone_back:
            return False
        # The newest stamp of a static edge is 0, that of an edge without data None.
        alive = {child for child, history in histories.items()
                 if history.newest_stamp and history.newest_stamp >= horizon}
        return 2 * len(alive & self._gone_back) > len(alive)
