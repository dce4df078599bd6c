# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Several sources of one edge: the samples of all are kept, and the tree uses those of one.

A transition to another source works like a correction of the edge. It begins with the offset
from the new source's samples to the edge's present pose, and ends without an offset. The rule
defines when a source is replaced.
"""

from collections.abc import Sequence
from typing import NamedTuple

from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import BEGINNING, FOREVER, format_span
from tf_tree_py.core.text import known_names
from tf_tree_py.core.tree.tree import too_old, Tree

from .source_samples import SourceSamples
from ..corrections.absorbing import Transition, transition
from ..corrections.blend import BlendLimits
from ..corrections.corrected import corrected


class Rule(NamedTuple):
    """
    The rule for replacing the source of an edge by another.

    :ivar max_age: how far its newest sample may be behind another source's, nanoseconds.
    :ivar gate: how much its motion over the window may differ from another source's: metres
        and radians. None: by any amount.
    :ivar window: nanoseconds.
    :ivar limits: the limits of the transition.
    :ivar prefer: sources, the best first.
    :ivar steady: how long a better source must have sent before it is used again, nanoseconds.
    """

    max_age: int
    gate: tuple[float, float] | None
    window: int
    limits: BlendLimits
    prefer: tuple[str, ...] = ()
    steady: int = 0


class EdgeSources(SourceSamples):
    """Switches from one source of an edge to another, while samples arrive."""

    def __init__(self, parent: str, child: str, cache_time: int) -> None:
        super().__init__(parent, child)
        self.cache_time = cache_time
        self.rule: Rule | None = None
        self.clear()

    def clear(self) -> None:
        """Remove all samples; the next source that sends becomes the active one."""
        super().clear()
        self._strangers: set[str] = set()
        # Since when each source has been sending without a gap.
        self._steady_since: dict[str, int] = {}
        # The limits of the transition to the active source, while it has not reached the edge.
        self._awaited: BlendLimits | None = None
        # The tree takes the active source's samples after the first stamp. Motions are compared
        # again after the second stamp.
        self._since = self._judge_after = BEGINNING - 1

    def insert(self, tree: Tree, name: str, sample: Sample) -> tuple[list[Sample], list[Incident]]:
        """
        Store a sample of a source.

        :return: the samples to insert into the tree now, and the incidents.
        :raises InvalidArgumentException: the edge has another parent.
        """
        if sample.parent != self.parent:
            raise InvalidArgumentException(
                f'The sources of {self.child!r} have the parent {self.parent!r}, and {name!r} '
                f'has {sample.parent!r}. All sources of one edge must have the same parent')
        edge = tree.histories.get(self.child)
        if edge is None or edge.newest_stamp is None:
            self.clear()
        history = self.histories.get(name)
        if history is None:
            history = self.histories[name] = Samples(self.child, self.cache_time, name)
        if not history.insert(sample.stamp, sample.parent, sample.pose):
            return [], [too_old(history, sample.parent, sample.stamp, name, self.cache_time)]
        if not self.active:
            self.active = self.answering = name
        incidents = self._strange(edge, sample.stamp) + self._judged(tree, sample.stamp)
        if self._awaited is not None:
            return self.begin(tree, self._awaited)[1], incidents
        is_for_tree = name == self.active and sample.stamp > self._since
        return ([sample] if is_for_tree else []), incidents

    def _strange(self, edge: History | None, stamp: int) -> list[Incident]:
        """Return an incident if another publisher inserts samples besides the sources."""
        # If a static edge or a spline replaced theirs, that was reported already.
        if not isinstance(edge, Samples) or (
                edge.authority in self.histories or edge.authority in self._strangers):
            return []
        self._strangers.add(edge.authority)
        return [Incident(
            Kind.TWO_PUBLISHERS, self.parent, self.child, stamp, edge.authority,
            f'{edge.authority!r} inserts samples of {self.parent} -> {self.child}, which has the '
            f'sources {_listed(tuple(self.histories))}: the edge alternates between both. '
            'Insert them with insert_from, as another source')]

    # --- transitions

    def switch(self, tree: Tree, name: str,
               limits: BlendLimits) -> tuple[Transition | None, list[Sample]]:
        """
        Switch to a source, at once or as soon as it has reached the edge.

        :return: the transition, None while the source has not reached the edge; and the samples
            to insert into the tree now.
        :raises InvalidArgumentException: there is no such source, it began too late, it is
            silent, or it is in use already; or the edge can no longer be corrected.
        """
        if name not in self.histories:
            raise InvalidArgumentException(
                f'{self.parent} -> {self.child} has no source {name!r}. '
                f'{known_names(name, tuple(self.histories))}')
        corrected(tree.histories.get(self.child), self.child)  # raises an error if impossible
        if not self._can_follow(tree, name):
            raise InvalidArgumentException(
                f'The source {name!r} began after the newest sample of {self.parent} -> '
                f'{self.child}, so their offset is unknown')
        if self.histories[name].fell_silent(self._newest(tree)):
            raise InvalidArgumentException(
                f'The source {name!r} has sent nothing since {_ends(self.histories[name])[1]} '
                f'ns, and {self.parent} -> {self.child} has reached {self._newest(tree)} ns: '
                'the edge would not move. Switch when the source sends again')
        if name == self.active and self._awaited is None:
            raise InvalidArgumentException(
                f'{self.parent} -> {self.child} has the source {name!r} already')
        self._choose(name)
        return self.begin(tree, limits)

    def _newest(self, tree: Tree) -> int:
        stamp = tree.histories[self.child].newest_stamp
        assert stamp is not None
        return stamp

    def _choose(self, name: str) -> None:
        self.active = name
        self.made_way.pop(name, None)

    def begin(self, tree: Tree, limits: BlendLimits) -> tuple[Transition | None, list[Sample]]:
        """Begin the transition to the active source, if it has reached the edge."""
        edge = corrected(tree.histories.get(self.child), self.child)
        history, stamp = self.histories[self.active], edge.newest_stamp
        assert stamp is not None
        if history.newest_stamp is None or history.newest_stamp < stamp:
            self._awaited = limits
            return None, []
        self._awaited, self._since = None, stamp
        self.answering = self.active
        tree.replace(edge)
        stage = edge.change_source(history.sample(stamp), limits)
        return transition(tree, stage), self._after(history, stamp)

    def _after(self, history: Samples, stamp: int) -> list[Sample]:
        """Return a source's samples after a stamp."""
        samples, stamp = [], history.next_stamp(stamp)
        while stamp < FOREVER:
            samples.append(Sample(self.parent, self.child, stamp, history.sample(stamp)))
            stamp = history.next_stamp(stamp)
        return samples

    def _can_follow(self, tree: Tree, name: str) -> bool:
        """Return whether a source began early enough for a transition to it."""
        edge = tree.histories.get(self.child)
        # A static edge or a curve may have replaced theirs.
        return (isinstance(edge, Samples) and edge.newest_stamp is not None
                and _ends(self.histories[name])[0] <= edge.newest_stamp)

    # --- by rule

    def _judged(self, tree: Tree, stamp: int) -> list[Incident]:
        """Choose another source if the rule requires it; return its incident."""
        rule = self.rule
        if rule is None:
            return []
        alive = [name for name, history in self.histories.items()
                 if _ends(history)[1] >= stamp - rule.max_age]
        self._steady_since = {name: self._steady_since.get(name, stamp) for name in alive}
        others = [name for name in alive if name != self.active and self._can_follow(tree, name)]
        if not others:
            return []
        if self.active not in alive:
            return [self._make_way(others[0], Kind.SOURCE_SILENT, stamp,
                                   f'sent nothing for more than {format_span(rule.max_age)}')]
        if self._awaited is not None:
            return []
        better = self._better(rule, others, stamp)
        if better is not None:
            return [self._make_way(better, Kind.SOURCE_PREFERRED, stamp,
                                   f'is less preferred than {better!r}, which is steady again')]
        if rule.gate is None or stamp < self._judge_after:
            return []
        self._judge_after = stamp + rule.window // 10
        return self._diverged(rule, alive, others, stamp)

    def _better(self, rule: Rule, others: list[str], stamp: int) -> str | None:
        """Return the best steady source that is preferred to the active one, if any."""
        order = list(rule.prefer)
        rank = order.index(self.active) if self.active in order else len(order)
        for name in order[:rank]:
            if name in others and stamp - self._steady_since[name] >= rule.steady and (
                    rule.gate is None or self._agrees_now(rule, name)):
                return name
        return None

    def _agrees_now(self, rule: Rule, name: str) -> bool:
        """Return whether a source moved like the active one over the window."""
        spans = [_ends(self.histories[each]) for each in (name, self.active)]
        newest = min(end for _, end in spans)
        return max(begin for begin, _ in spans) <= newest - rule.window and self._agree(
            rule, name, self.active, newest)

    def _diverged(self, rule: Rule, alive: list[str], others: list[str],
                  stamp: int) -> list[Incident]:
        """Replace the source if more of them, or preferred ones, agree on another motion."""
        newest = min(_ends(self.histories[name])[1] for name in alive)
        known = [name for name in alive
                 if _ends(self.histories[name])[0] <= newest - rule.window]
        agreeing = {name: [other for other in known if self._agree(rule, name, other, newest)]
                    for name in known}
        # Of several maxima, max() returns the first, which is the preferred source.
        believed = max(known, key=lambda name: len(agreeing[name]), default=None)
        if believed is None or self.active not in known or self.active in agreeing[believed] or (
                believed not in others):
            return []
        return [self._make_way(
            believed, Kind.SOURCE_DIVERGED, stamp,
            f'moved differently from {_listed(agreeing[believed])} over '
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
        incident = self.made_way[before] = Incident(
            kind, self.parent, self.child, stamp, before,
            f'the source {before!r} {why}; the edge switches to {name!r}')
        return incident


def _ends(history: Samples) -> tuple[int, int]:
    """Return the oldest and the newest stamp of a source; it has samples."""
    assert history.oldest_stamp is not None and history.newest_stamp is not None
    return history.oldest_stamp, history.newest_stamp


def _listed(names: Sequence[str]) -> str:
    return ', '.join(map(repr, names))
