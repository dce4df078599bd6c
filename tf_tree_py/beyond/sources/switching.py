# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Several sources of one edge in a live buffer: inserting, switching between them, and queries.

``edge_sources`` has the rule.
"""

from collections.abc import Sequence
import math
import operator
from typing import SupportsIndex

from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import admitted, checked, checked_frame, Sample
from tf_tree_py.core.stamp import format_span, from_seconds
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.tree import Tree

from .edge_sources import EdgeSources, Rule
from .source_samples import EdgeSource, Sources, sources_by_child
from ..corrections.absorbing import checked_limits, CorrectionQueries, DEFAULT_OVER, Transition
from ..corrections.blend import BlendLimits

_DEFAULT_WINDOW = from_seconds(1.0)
_DEFAULT_STEADY = from_seconds(2.0)


def _checked_source(source: object) -> str:
    """
    Return the name of a caller's source.

    :raises InvalidArgumentException: it is not a name.
    """
    if not isinstance(source, str) or not source:
        raise InvalidArgumentException(f'source must be the name of a source, not {source!r}')
    return source


def _checked_rule(max_age: int, gate: tuple[float, float] | None, window: int, limits: BlendLimits,
                  prefer: Sequence[str] = (), steady: int = _DEFAULT_STEADY) -> Rule:
    """
    Return a caller's rule.

    :raises InvalidArgumentException: an invalid span, gate or list of names.
    """
    if isinstance(prefer, str) or not all(isinstance(name, str) for name in prefer):
        raise InvalidArgumentException(
            f'prefer must be a list of names of sources, not {prefer!r}')
    return Rule(_span('max_age', max_age), _gate(gate), _span('window', window), limits,
                tuple(prefer), _span('steady', steady))


def _span(name: str, given: SupportsIndex) -> int:
    try:
        span = operator.index(given)
    except TypeError:
        span = 0
    if span <= 0:
        raise InvalidArgumentException(
            f'{name} must be a positive number of nanoseconds, not {given!r}')
    return span


def _gate(given: tuple[float, float] | None) -> tuple[float, float] | None:
    if given is None:
        return None
    try:
        metres, radians = map(float, given)
    except (TypeError, ValueError):
        metres = radians = math.nan
    if not (metres >= 0.0 and radians >= 0.0):
        raise InvalidArgumentException(
            f'gate must be metres and radians, or None, not {given!r}')
    return metres, radians


# --- insertion into a buffer

class SourceBuffer(PlainBuffer):
    """A buffer whose edges may have several sources."""

    def insert_from(self, source: str, parent: str, child: str, stamp: Stamp,
                    pose: PoseLike) -> list[Incident]:
        """
        Insert a transform from one of several sources of an edge.

        The samples of all sources are kept. Lookups use one source: the first that sent a
        sample, until ``switch`` or the rule selects another one.

        :param source: its name, such as 'wheels'; also the authority.
        :return: the incidents, including a source that was replaced.
        :raises InvalidArgumentException: an invalid stamp, pose or name, or a parent
            that differs from that of the other sources.

        The other parameters are those of ``insert``.
        """
        source = _checked_source(source)
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self.intake.insert(
            [sample], source, insert=self._insert_of_source, announced=True)

    def _insert_of_source(self, samples: list[Sample], source: str, _: bool) -> list[Incident]:
        incidents: list[Incident] = []
        for sample in samples:
            sound = checked(sample, source)
            if isinstance(sound, Incident):
                self.intake.count(0, [sound])
                return [sound]
            sources = _made(self._tree, sound.parent, sound.child)
            chosen, reported = sources.insert(self._tree, source, sound)
            self.intake.count(0, reported)
            self.intake.announce(chosen, sources.active)
            incidents += reported + self.intake.insert_each(chosen, sources.active, False)
        return incidents

    def switch(self, child: str, to: str, over: int = DEFAULT_OVER, *,
               max_speed: float = math.inf, max_turn_rate: float = math.inf,
               reach: float = 0.0) -> Transition | None:
        """
        Switch an edge to another of its sources, with a blend like that of a correction.

        The blend begins at the edge's current pose and ends at the poses of the other source.
        The edge's corrections are removed, because they were measured for the previous source.

        :param to: the name of a source that has sent samples.
        :return: when the blend begins and ends; None if the switch is pending: a source that
            lags behind becomes active when it has reached the edge's newest sample.
        :raises InvalidArgumentException: an unknown source, the active source, a source that
            began after the edge's newest sample, or one that fell silent long before it.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        child = checked_frame(child)
        changes: list[Transition | None] = []

        def insert() -> None:
            change, samples = _sources_of(self._tree, child).switch(self._tree, to, limits)
            changes.append(change)
            self.intake.insert_each(samples, to, False)

        self.waiting.change(self._tree, lambda: [child], insert)
        return changes[0]

    def switch_by_rule(self, child: str, *, max_age: int, gate: tuple[float, float] | None = None,
                       window: int = _DEFAULT_WINDOW, over: int = DEFAULT_OVER,
                       max_speed: float = math.inf, max_turn_rate: float = math.inf,
                       reach: float = 0.0, prefer: Sequence[str] = (),
                       steady: int = _DEFAULT_STEADY) -> None:
        """
        Replace the active source of an edge when it fails; each replacement is an incident.

        A source that falls silent is replaced by the oldest of the others. A source whose
        motion differs from that of the others is replaced by one of the largest group of
        sources that agree; of groups of equal size, the one with the oldest source. The oldest
        source is the one that sent its first sample first. The rule is evaluated whenever a
        sample of any source arrives, without polling.

        :param max_age: how far a source's newest sample may lie behind that of another,
            nanoseconds.
        :param gate: by how many metres and radians the motions of two sources over the
            window may differ; None: no limit.
        :param window: nanoseconds; with a gate it must be shorter than ``cache_time``.
        :param prefer: sources, the best first: the edge returns to a better source that is
            steady again. Sources that are not listed come last.
        :param steady: how long a better source must have sent without a pause of max_age before
            the edge returns to it, nanoseconds; with a gate it must also agree.
        :raises InvalidArgumentException: an edge without sources, an invalid limit, or a buffer
            that keeps too little history to compare motions.

        One stamp in the far future makes all other sources silent: set ``max_future`` to
        refuse such stamps.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        rule = _checked_rule(max_age, gate, window, limits, prefer, steady)
        if rule.gate and rule.window >= self._tree.cache_time:
            raise InvalidArgumentException(
                f'Motions cannot be compared over a window of {format_span(rule.window)}, because '
                f'the buffer keeps {format_span(self._tree.cache_time)}: set a longer cache_time')
        with self._lock:
            _sources_of(self._tree, checked_frame(child)).rule = rule


def _made(tree: Tree, parent: str, child: str) -> EdgeSources:
    """Return the sources of an edge; new ones if it has none."""
    sources = _known(tree, child)
    if sources is None:
        sources = EdgeSources(parent, child, tree.cache_time)
        tree.companion_or_new(Sources).by_child[child] = sources
    return sources


def _known(tree: Tree, child: str) -> EdgeSources | None:
    known = sources_by_child(tree).get(child)
    return known if isinstance(known, EdgeSources) else None


def _sources_of(tree: Tree, child: str) -> EdgeSources:
    sources = _known(tree, child)
    if sources is None:
        raise InvalidArgumentException(
            f'The edge of {child!r} has no sources: call insert_from first')
    return sources


# --- queries

class SourceQueries(CorrectionQueries):
    """The sources of edges, thread-safe."""

    def sources_of(self, child: str) -> list[EdgeSource]:
        """Return the sources of an edge, in order of their first samples."""
        with self._lock:
            sources = sources_by_child(self._tree).get(child)
            return [] if sources is None else sources.listed()

    def _smoothed(self) -> Tree:
        twin = super()._smoothed()
        for child, sources in sources_by_child(self._tree).items():
            history = self._tree.histories.get(child)
            of_source = sources.smoothed(history) if history is not None else None
            if of_source is not None:
                twin.replace(of_source)
        return twin
