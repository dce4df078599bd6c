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
Several sources of one edge: the samples of all are kept, and the tree has those of one.

Going over to another source is done like a correction of the edge. It begins with the offset
from the new source's samples to where the edge is, and ends with none. The rule says when a
source has to make way.
"""

from collections.abc import Sequence
from typing import NamedTuple

from .corrections import counted, Transition
from .remarks import too_old
from .tree import Tree
from ..arrivals.incidents import Incident, Kind
from ..arrivals.sample import Sample
from ..edges.corrected import can_be_corrected, corrected, CorrectedHistory
from ..edges.discrete import DynamicHistory
from ..errors import InvalidArgumentException
from ..geometry import se3
from ..geometry.blend import Limits
from ..stamp import BEGINNING, FOREVER, format_span
from ..suggest import known_names


class Rule(NamedTuple):
    """
    When the source of an edge makes way for another.

    :ivar max_age: how far its newest sample may lie behind another's, nanoseconds.
    :ivar gate: by how much its motion over the window may differ from another's: metres and
        radians. None: by any.
    :ivar window: nanoseconds.
    :ivar limits: how the edge goes over.
    """

    max_age: int
    gate: tuple[float, float] | None
    window: int
    limits: Limits


class Source(NamedTuple):
    """
    One of several sources of an edge, as a person looks at it.

    :ivar newest: its newest stamp, nanoseconds.
    :ivar is_active: whether the tree answers by it.
    :ivar made_way: why it made way last by the rule; None where it did not, or answers again.
    """

    name: str
    newest: int
    is_active: bool
    made_way: Incident | None = None


class Sources:
    """
    The sources of one edge, by name; those heard first are preferred.

    :ivar histories: the samples of each source, as they came in.
    :ivar active: the one by which the tree answers, or will answer.
    """

    def __init__(self, parent: str, child: str, cache_time: int) -> None:
        self.parent, self.child, self.cache_time = parent, child, cache_time
        self.histories: dict[str, DynamicHistory] = {}
        self.rule: Rule | None = None
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Forget what was heard: the first that is heard will be the active one."""
        self.histories.clear()
        self._made_way: dict[str, Incident] = {}
        self.active = ''
        # How to go over to the active source, while the tree waits for it to reach the edge.
        self._awaited: Limits | None = None
        # The tree takes the active source's samples after the first stamp. Motions are compared
        # again after the second one.
        self._since = self._judge_after = BEGINNING - 1

    def take(self, tree: Tree, name: str, sample: Sample) -> tuple[list[Sample], list[Incident]]:
        """
        Keep a source's sample.

        :return: the samples that the tree is to have now, and what there is to tell.
        :raises InvalidArgumentException: the edge has another parent.
        """
        if sample.parent != self.parent:
            raise InvalidArgumentException(
                f'The sources of {self.child!r} say where it is in {self.parent!r}; {name!r} '
                f'says {sample.parent!r}. Sources of one edge have one parent')
        edge = tree.histories.get(self.child)
        if edge is None or edge.latest_stamp is None:
            self._begin_anew()
        history = self.histories.get(name)
        if history is None:
            history = self.histories[name] = DynamicHistory(self.child, self.cache_time, name)
        if not history.insert(sample.stamp, sample.parent, sample.pose):
            return [], [too_old(history, sample.parent, sample.stamp, name, self.cache_time)]
        self.active = self.active or name
        incidents = self._judged(tree, sample.stamp)
        if self._awaited is not None:
            return self.begin(tree, self._awaited)[1], incidents
        is_for_tree = name == self.active and sample.stamp > self._since
        return ([sample] if is_for_tree else []), incidents

    # --- going over

    def switch(self, tree: Tree, name: str,
               limits: Limits) -> tuple[Transition | None, list[Sample]]:
        """
        Go over to a source, at once or as soon as it has reached the edge.

        :return: None as long as it has not, and the samples that the tree is to have now.
        :raises InvalidArgumentException: there is no such source, or it began too late, or the
            edge has become one that cannot be corrected.
        """
        if name not in self.histories:
            raise InvalidArgumentException(
                f'{self.parent} -> {self.child} has no source {name!r}. '
                f'{known_names(name, tuple(self.histories))}')
        corrected(tree.histories.get(self.child), self.child)  # or it says why that cannot be
        if not self._can_follow(tree, name):
            raise InvalidArgumentException(
                f'The source {name!r} began after the newest sample of {self.parent} -> '
                f'{self.child}, so nothing tells how they fit together')
        if name == self.active and self._awaited is None:
            raise InvalidArgumentException(
                f'{self.parent} -> {self.child} has the source {name!r} already')
        self._choose(name)
        return self.begin(tree, limits)

    def _choose(self, name: str) -> None:
        self.active = name
        self._made_way.pop(name, None)

    def begin(self, tree: Tree, limits: Limits) -> tuple[Transition | None, list[Sample]]:
        """Begin to go over to the active source, if that has reached the edge."""
        edge = corrected(tree.histories.get(self.child), self.child)
        history, stamp = self.histories[self.active], edge.latest_stamp
        assert stamp is not None
        if history.latest_stamp is None or history.latest_stamp < stamp:
            self._awaited = limits
            return None, []
        self._awaited, self._since = None, stamp
        tree.replace(edge)
        stage = edge.change_source(history.sample(stamp), limits)
        return counted(tree, stage), self._after(history, stamp)

    def _after(self, history: DynamicHistory, stamp: int) -> list[Sample]:
        """Return a source's samples after a stamp."""
        samples, stamp = [], history.next_stamp(stamp)
        while stamp < FOREVER:
            samples.append(Sample(self.parent, self.child, stamp, history.sample(stamp)))
            stamp = history.next_stamp(stamp)
        return samples

    def _can_follow(self, tree: Tree, name: str) -> bool:
        """Return whether a source began early enough to go over to it."""
        edge = tree.histories.get(self.child)
        # A static edge, or a spline, may have taken the place of theirs.
        return (can_be_corrected(edge) and edge.latest_stamp is not None
                and _ends(self.histories[name])[0] <= edge.latest_stamp)

    # --- by rule

    def _judged(self, tree: Tree, stamp: int) -> list[Incident]:
        """Choose another source if the rule says so; return the incident of that."""
        rule = self.rule
        if rule is None:
            return []
        alive = [name for name, history in self.histories.items()
                 if _ends(history)[1] >= stamp - rule.max_age]
        others = [name for name in alive if name != self.active and self._can_follow(tree, name)]
        if not others:
            return []
        if self.active not in alive:
            return [self._make_way(others[0], Kind.SOURCE_SILENT, stamp,
                                   f'sent nothing for more than {format_span(rule.max_age)}')]
        if self._awaited is not None or rule.gate is None or stamp < self._judge_after:
            return []
        self._judge_after = stamp + rule.window // 10
        return self._diverged(rule, alive, others, stamp)

    def _diverged(self, rule: Rule, alive: list[str], others: list[str],
                  stamp: int) -> list[Incident]:
        """Let the source make way if more of them, or preferred ones, agree on another motion."""
        newest = min(_ends(self.histories[name])[1] for name in alive)
        known = [name for name in alive
                 if _ends(self.histories[name])[0] <= newest - rule.window]
        agreeing = {name: [other for other in known if self._agree(rule, name, other, newest)]
                    for name in known}
        # Of several maxima max() takes the first, which is the preferred source.
        believed = max(known, key=lambda name: len(agreeing[name]), default=None)
        if believed is None or self.active not in known or self.active in agreeing[believed] or (
                believed not in others):
            return []
        return [self._make_way(
            believed, Kind.SOURCE_DIVERGED, stamp,
            f'moved otherwise than {_listed(agreeing[believed])} over '
            f'{format_span(rule.window)}')]

    def _agree(self, rule: Rule, one: str, other: str, newest: int) -> bool:
        assert rule.gate is not None
        motions = [se3.compose(se3.inverse(history.sample(newest - rule.window)),
                               history.sample(newest))
                   for history in (self.histories[one], self.histories[other])]
        distance, angle = se3.distance(*motions)
        return distance <= rule.gate[0] and angle <= rule.gate[1]

    def _make_way(self, name: str, kind: Kind, stamp: int, why: str) -> Incident:
        assert self.rule is not None
        before, self._awaited = self.active, self.rule.limits
        self._choose(name)
        incident = self._made_way[before] = Incident(
            kind, self.parent, self.child, stamp, before,
            f'the source {before!r} {why}; the edge goes over to {name!r}')
        return incident

    # --- looking

    def listed(self) -> list[Source]:
        """Return them, the preferred ones first."""
        return [Source(name, _ends(history)[1], name == self.active,
                       self._made_way.get(name))
                for name, history in self.histories.items()]

    def smoothed(self, edge: CorrectedHistory) -> DynamicHistory:
        """Return the active source's samples, with its own corrections, at all stamps."""
        plain = self.histories[self.active].copy()
        stamps, poses = plain.copy_between(BEGINNING, FOREVER - 1)
        plain.set_poses(edge.correction.smoothed(stamps, poses))
        return plain


def _ends(history: DynamicHistory) -> tuple[int, int]:
    """Return the oldest and the newest stamp of a source, which has been heard."""
    assert history.oldest_stamp is not None and history.latest_stamp is not None
    return history.oldest_stamp, history.latest_stamp


def _listed(names: Sequence[str]) -> str:
    return ', '.join(map(repr, names))
