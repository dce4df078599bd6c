# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Several sources of one edge in a live buffer, and going over from one to another.

``tree.sources`` says what that is, and what the rule is.
"""

import math
import operator
from typing import Any

from .correcting import checked_frame
from .intake import Intake
from .waiting import Waiting
from ..arrivals.incidents import Incident
from ..arrivals.sample import checked, Sample
from ..edges.corrected import CorrectedHistory
from ..errors import InvalidArgumentException
from ..geometry.blend import Limits
from ..stamp import format_span, from_seconds
from ..tree.corrections import smoothed, Transition
from ..tree.sources import Rule, Source, Sources
from ..tree.tree import Tree

DEFAULT_WINDOW = from_seconds(1.0)


class Switching:
    """
    The sources of a buffer's edges; of most edges there are none.

    Its methods may be called from any thread, without the buffer's lock; ``BufferCore`` says
    what they are for.
    """

    def __init__(self, tree: Tree, waiting: Waiting, intake: Intake) -> None:
        """
        Begin with no sources.

        :param tree: whose edges have them, with the lock of those who wait for it.
        :param intake: takes the samples that the tree is to have.
        """
        self._tree = tree
        self._waiting = waiting
        self._lock = waiting.lock
        self._intake = intake
        self._sources: dict[str, Sources] = {}

    def take(self, source: str, sample: Sample) -> list[Incident]:
        """Take a sample of a source; return what was refused, and which source made way."""
        return self._intake.take([sample], source, False, self._insert)

    def _insert(self, samples: list[Sample], source: str, _: bool) -> list[Incident]:
        incidents: list[Incident] = []
        for sample in samples:
            sound = checked(sample, source)
            if isinstance(sound, Incident):
                self._intake.count(0, [sound])
                return [sound]
            sources = self._sources.setdefault(
                sound.child, Sources(sound.parent, sound.child, self._tree.cache_time))
            chosen, told = sources.take(self._tree, source, sound)
            self._intake.count(0, told)
            incidents += told + self._intake.insert_each(chosen, sources.active, False)
        return incidents

    def switch(self, child: str, to: str, limits: Limits) -> Transition | None:
        """Let an edge go over to another of its sources; None if it has to wait for that."""
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
        Let the sources of an edge make way for each other.

        :raises InvalidArgumentException: it has none, or the buffer keeps too little to compare
            motions.
        """
        if rule.gate and rule.window >= self._tree.cache_time:
            raise InvalidArgumentException(
                f'Over a window of {format_span(rule.window)} no motions can be compared, for the '
                f'buffer keeps {format_span(self._tree.cache_time)}: allow a longer cache_time')
        with self._lock:
            self._sources_of(checked_frame(child)).rule = rule

    def sources_of(self, child: str) -> list[Source]:
        """Return the sources of an edge, those heard first before the others."""
        with self._lock:
            sources = self._sources.get(child)
            return sources.listed() if sources else []

    def smoothed(self) -> Tree:
        """Return a copy of the tree in which every sample has the correction of its stamp."""
        with self._lock:
            twin = smoothed(self._tree)
            for child, sources in self._sources.items():
                edge = self._tree.histories.get(child)
                if isinstance(edge, CorrectedHistory) and len(edge):
                    twin.replace(sources.smoothed(edge))
            return twin

    def _sources_of(self, child: str) -> Sources:
        if child not in self._sources:
            raise InvalidArgumentException(
                f'The edge of {child!r} has no sources: insert_from makes some')
        return self._sources[child]


def checked_source(source: Any) -> str:
    """
    Return the name of a caller's source.

    :raises InvalidArgumentException: it is none.
    """
    if not isinstance(source, str) or not source:
        raise InvalidArgumentException(f'source is the name of one, not {source!r}')
    return source


def checked_rule(max_age: int, gate: tuple[float, float] | None, window: int,
                 limits: Limits) -> Rule:
    """
    Return a caller's rule.

    :raises InvalidArgumentException: what is no span, or no gate.
    """
    return Rule(_span('max_age', max_age), _gate(gate), _span('window', window), limits)


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
