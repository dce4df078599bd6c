"""
Several sources of one edge in a live buffer, and going over from one to another.

What that is, and which rule there is, ``tree.sources`` says.
"""

import math
import operator
from typing import Any

from .correcting import checked_frame, checked_limits, Correcting, DEFAULT_OVER
from .intake import Intake
from .waiting import Waiting
from ..arrivals.future_guard import FutureGuard
from ..arrivals.incidents import Incident
from ..arrivals.jump_back import JumpBack
from ..arrivals.observers import Observers
from ..arrivals.sample import admitted, checked, Sample
from ..edges.corrected import CorrectedHistory
from ..errors import InvalidArgumentException
from ..geometry.poses import checked_pose
from ..geometry.se3 import PoseTuple
from ..stamp import format_span, from_seconds
from ..tree.corrections import Transition
from ..tree.queries import Snapshot
from ..tree.sources import Rule, Source, Sources
from ..tree.tree import Tree

DEFAULT_WINDOW = from_seconds(1.0)


class Switching(Correcting):
    """A buffer whose edges may have several sources each."""

    def __init__(self, tree: Tree, future_guard: FutureGuard, jump_back: JumpBack | None) -> None:
        super().__init__(tree)
        self.waiting = Waiting(self._lock)
        """All who wait for data; its length is how many."""
        self.observers = Observers()
        self.intake = Intake(tree, self.waiting, self.observers, future_guard, jump_back)
        """The way in, for those who feed the buffer what was checked already."""
        self._sources: dict[str, Sources] = {}

    def insert_from(self, source: str, parent: str, child: str, stamp: int,
                    pose: PoseTuple) -> list[Incident]:
        """
        Take a transform of one of several sources of an edge.

        All are kept; lookups are answered by one of them, the first that is heard unless
        ``switch`` or the rule says otherwise.

        :param source: its name, such as 'wheels'; also the authority.
        :return: what was refused or is worth telling, and which source made way.
        :raises InvalidArgumentException: what is no stamp, no pose or no name, or another
            parent than that of the other sources.

        The other parameters are those of ``insert``.
        """
        if not isinstance(source, str) or not source:
            raise InvalidArgumentException(f'source is the name of one, not {source!r}')
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self.intake.take([sample], source, False, self._insert_from)

    def _insert_from(self, samples: list[Sample], source: str, _: bool) -> list[Incident]:
        incidents: list[Incident] = []
        for sample in samples:
            sound = checked(sample, source)
            if isinstance(sound, Incident):
                self.intake.count(0, [sound])
                return [sound]
            sources = self._sources.setdefault(
                sound.child, Sources(sound.parent, sound.child, self.cache_time))
            chosen, told = sources.take(self._tree, source, sound)
            self.intake.count(0, told)
            incidents += told + self.intake.insert_each(chosen, sources.active, False)
        return incidents

    def switch(self, child: str, to: str, over: int = DEFAULT_OVER, *,
               max_speed: float = math.inf, max_turn_rate: float = math.inf,
               reach: float = 0.0) -> Transition | None:
        """
        Let an edge go over to another of its sources, as it goes over to a correction.

        It begins where the edge is, and ends with what the other source says. The edge's
        corrections end with it, for they were those of the source before.

        :param to: the name of a source that was heard already.
        :return: when it begins and ends; None if it has to wait, for a source that lags
            behind goes on only when it has reached the edge's newest sample.
        :raises InvalidArgumentException: no such source, the active one, or one that began
            after the edge's newest sample.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        child = checked_frame(child)
        changes: list[Transition | None] = []

        def insert() -> None:
            change, samples = self._sources_of(child).switch(self._tree, to, limits)
            changes.append(change)
            self.intake.insert_each(samples, to, False)

        self.waiting.change(self._tree, lambda: [child], insert)
        return changes[0]

    def switch_by_rule(self, child: str, *, max_age: int, gate: tuple[float, float] | None = None,
                       window: int = DEFAULT_WINDOW, over: int = DEFAULT_OVER,
                       max_speed: float = math.inf, max_turn_rate: float = math.inf,
                       reach: float = 0.0) -> None:
        """
        Let the sources of an edge make way for each other, and tell it as an incident.

        One that falls silent makes way for the first heard of the others; one that moves
        otherwise for the largest group that agrees, where none is larger for that of the
        first heard. What arrives from any of them is the occasion: nothing polls.

        :param max_age: how far a source's newest sample may lie behind that of another,
            nanoseconds.
        :param gate: by how many metres and radians the motions of two sources over the
            window may differ; None: by any.
        :param window: nanoseconds; with a gate shorter than ``cache_time``.
        :raises InvalidArgumentException: an edge that has no sources, or what is no limit.

        One stamp of the far future makes all others silent: ``max_future`` keeps such out.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        rule = Rule(_span('max_age', max_age), _gate(gate), _span('window', window), limits)
        if rule.gate and rule.window >= self.cache_time:
            raise InvalidArgumentException(
                f'Over a window of {format_span(rule.window)} no motions can be compared, for the '
                f'buffer keeps {format_span(self.cache_time)}: allow a longer cache_time')
        with self._lock:
            self._sources_of(checked_frame(child)).rule = rule

    def sources_of(self, child: str) -> list[Source]:
        """Return the sources of an edge, those heard first before the others."""
        with self._lock:
            sources = self._sources.get(child)
            return sources.listed() if sources else []

    def smoothed(self) -> Snapshot:
        """
        Return everything as all corrections together have it; see ``Correcting``.

        An edge that has sources is what the active one says, from its beginning on.
        """
        with self._lock:
            twin = super().smoothed()
            for child, sources in self._sources.items():
                edge = self._tree.histories.get(child)
                if isinstance(edge, CorrectedHistory) and len(edge):
                    twin._tree.replace(sources.smoothed(edge))
            return twin

    def _sources_of(self, child: str) -> Sources:
        if child not in self._sources:
            raise InvalidArgumentException(
                f'The edge of {child!r} has no sources: insert_from makes some')
        return self._sources[child]


def _span(name: str, given: Any) -> int:
    try:
        span = operator.index(given)
    except TypeError:
        span = 0
    if span <= 0:
        raise InvalidArgumentException(
            f'{name} is a positive number of nanoseconds, not {given!r}')
    return span


def _gate(given: Any) -> tuple[float, float] | None:
    if given is None:
        return None
    try:
        metres, radians = map(float, given)
    except (TypeError, ValueError):
        metres = radians = math.nan
    if not (metres >= 0.0 and radians >= 0.0):
        raise InvalidArgumentException(f'gate is metres and radians, or None, not {given!r}')
    return metres, radians
