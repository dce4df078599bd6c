# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Several sources of one edge in a live buffer, and switching between them.

``tree.sources`` describes sources and the rule.
"""

from collections.abc import Sequence
import math
import operator
from typing import Any

from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import checked, checked_frame, Sample
from tf_tree_py.core.stamp import format_span, from_seconds
from tf_tree_py.core.tree.tree import Tree

from .edge_sources import EdgeSources, Rule
from .source_samples import Sources, SourceSamples
from ..corrections.absorbing import Transition
from ..corrections.blend import BlendLimits

DEFAULT_WINDOW = from_seconds(1.0)
DEFAULT_STEADY = from_seconds(2.0)


class Switching:
    """
    The sources of a buffer's edges; most edges have none.

    Its methods are thread-safe, and are called without the buffer's lock; ``BufferCore``
    documents them.
    """

    def __init__(self, tree: Tree, waiting: Waiting, intake: Intake) -> None:
        """
        Start without sources.

        :param tree: the tree that contains the edges.
        :param intake: inserts the samples of the active source into the tree.
        """
        self._tree = tree
        self._waiting = waiting
        self._lock = waiting.lock
        self._intake = intake
        self._sources: dict[str, EdgeSources] = {}

    def take(self, source: str, sample: Sample) -> list[Incident]:
        """Insert a sample of a source; return refusals, and a source that was replaced."""
        return self._intake.take_announced([sample], source, False, self._insert)

    def _insert(self, samples: list[Sample], source: str, _: bool) -> list[Incident]:
        incidents: list[Incident] = []
        for sample in samples:
            sound = checked(sample, source)
            if isinstance(sound, Incident):
                self._intake.count(0, [sound])
                return [sound]
            sources = self._made(sound.parent, sound.child)
            chosen, told = sources.take(self._tree, source, sound)
            self._intake.count(0, told)
            self._intake.announce(chosen, sources.active)
            incidents += told + self._intake.insert_each(chosen, sources.active, False)
        return incidents

    def _made(self, parent: str, child: str) -> EdgeSources:
        """Return the sources of an edge; a new object if it has none or was removed."""
        sources = self._known(child)
        if sources is None:
            sources = self._sources[child] = EdgeSources(parent, child, self._tree.cache_time)
            self._samples[child] = sources.samples
        return sources

    @property
    def _samples(self) -> dict[str, SourceSamples]:
        return self._tree.companion_or_new(Sources).by_child

    def _known(self, child: str) -> EdgeSources | None:
        sources = self._sources.get(child)
        if sources is not None and self._samples.get(child) is not sources.samples:
            del self._sources[child]  # the frame was removed
            return None
        return sources

    def switch(self, child: str, to: str, limits: BlendLimits) -> Transition | None:
        """Switch an edge to another of its sources; return None if the switch is pending."""
        child = checked_frame(child)
        changes: list[Transition | None] = []

        def insert() -> None:
            change, samples = self._sources_of(child).switch(self._tree, to, limits)
            changes.append(change)
            self._intake.insert_each(samples, to, False)

        self._waiting.change(self._tree, lambda: [child], insert)
        return changes[0]

    def switch_by_rule(self, child: str, rule: Rule) -> None:
        """
        Replace the active source of an edge by a rule.

        :raises InvalidArgumentException: the edge has no sources, or the buffer keeps too
            little history to compare motions.
        """
        if rule.gate and rule.window >= self._tree.cache_time:
            raise InvalidArgumentException(
                f'Motions cannot be compared over a window of {format_span(rule.window)}, because '
                f'the buffer keeps {format_span(self._tree.cache_time)}: set a longer cache_time')
        with self._lock:
            self._sources_of(checked_frame(child)).rule = rule

    def _sources_of(self, child: str) -> EdgeSources:
        sources = self._known(child)
        if sources is None:
            raise InvalidArgumentException(
                f'The edge of {child!r} has no sources: call insert_from first')
        return sources


def checked_source(source: Any) -> str:
    """
    Return the name of a caller's source.

    :raises InvalidArgumentException: it is not a name.
    """
    if not isinstance(source, str) or not source:
        raise InvalidArgumentException(f'source must be the name of a source, not {source!r}')
    return source


def checked_rule(max_age: int, gate: tuple[float, float] | None, window: int, limits: BlendLimits,
                 prefer: Sequence[str] = (), steady: int = DEFAULT_STEADY) -> Rule:
    """
    Return a caller's rule.

    :raises InvalidArgumentException: an invalid span, gate or list of names.
    """
    if isinstance(prefer, str) or not all(isinstance(name, str) for name in prefer):
        raise InvalidArgumentException(
            f'prefer must be a list of names of sources, not {prefer!r}')
    return Rule(_span('max_age', max_age), _gate(gate), _span('window', window), limits,
                tuple(prefer), _span('steady', steady))


def _span(name: str, given: Any) -> int:
    try:
        span = operator.index(given)
    except TypeError:
        span = 0
    if span <= 0:
        raise InvalidArgumentException(
            f'{name} must be a positive number of nanoseconds, not {given!r}')
    return span


def _gate(given: Any) -> tuple[float, float] | None:
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
