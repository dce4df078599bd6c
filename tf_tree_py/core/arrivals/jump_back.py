"""Stamps that jump back where no clock does: a bag in a loop, a simulation that begins anew."""

from collections.abc import Mapping, Sequence

from .incidents import Incident, Kind
from ..edges.protocol import History
from ..stamp import format_span, from_seconds

WHY_OLD = ('A bag that loops, a simulation that was restarted, or a second publisher whose clock '
           'is slow')
CURE = ('For the first two set use_sim_time and let /clock be published, or pass '
        'Buffer(clear_on_jump_back=...)')

_PATIENCE = from_seconds(1.0)


class JumpBack:
    """
    Tells from stamps alone that another run has begun.

    Nothing else than a new run may look like one, so all of this has to come together:

    - Stamps are behind the newest that the buffer has seen by more than the limit, and
      not one message comes any more that is not. (A publisher whose clock is slow does
      not silence the others.)
    - More than half of the edges that were alive, those with data inside the limit, are
      among them. (An edge that was behind all along does not count.)
    - Each of these goes on for a second of its own stamps, in steps of no more than the
      limit. (Stragglers and a stamp that is sent over and over do not. A straggler of the
      run before, just before or after a new one begins, is no step of it.)

    If the run that was given up goes on after all, two publishers of the same edges
    disagree about the time, and the one was only slow. Then the second becomes two, four,
    and so on, so that they cannot make the buffer forget for ever in turns.

    Not safe for several threads: the buffer's lock is.
    """

    def __init__(self, limit: int) -> None:
        """
        Begin.

        :param limit: how far stamps must go back, nanoseconds: further than any
            publisher is late, and less than a run lasts.
        """
        if limit <= 0:
            raise ValueError(f'clear_on_jump_back is {limit} ns, and has to be positive')
        self._limit = limit
        self._patience = _PATIENCE
        self._given_up: int | None = None
        self.begin()

    def begin(self) -> None:
        """Begin anew, because the buffer was cleared."""
        self._newest: int | None = None
        # Of each edge that is behind: the first and the last stamp of its steps.
        self._steps: dict[str, tuple[int, int]] = {}
        self._gone_back: set[str] = set()

    def follow(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int], authority: str,
               histories: Mapping[str, History]) -> Incident | None:
        """
        Take note of a message, of one transform at least.

        :param edges: (parent, child) of each of its transforms.
        :param histories: what the buffer holds, without this message.
        :return: what to tell when another run has begun, and all that moves is to be
            forgotten.
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
            f'stamps went back by {format_span(back)} and go on from there: a bag that loops, or '
            'a simulation that was restarted. What moves was forgotten')

    def _go_on(self, newest: int) -> None:
        """Take note of a message of the run that is known."""
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
