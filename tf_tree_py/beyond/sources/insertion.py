# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Several sources of a buffer's edges."""

from collections.abc import Sequence
import math

from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import admitted, Sample
from tf_tree_py.core.times import Stamp

from .switching import checked_rule, checked_source, DEFAULT_STEADY, DEFAULT_WINDOW, Switching
from ..corrections.absorbing import Transition
from ..corrections.arguments import checked_limits, DEFAULT_OVER


class SourceBuffer(PlainBuffer):
    """A buffer whose edges may have several sources."""

    _known_switching: Switching | None = None

    def _switching(self) -> Switching:
        """Return the sources of the edges; created when the first sample of a source arrives."""
        with self._lock:
            if self._known_switching is None:
                self._known_switching = Switching(self._tree, self.waiting, self.intake)
            return self._known_switching

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
        source = checked_source(source)
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self._switching().take(source, sample)

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
        return self._switching().switch(
            child, to, checked_limits(over, max_speed, max_turn_rate, reach))

    def switch_by_rule(self, child: str, *, max_age: int, gate: tuple[float, float] | None = None,
                       window: int = DEFAULT_WINDOW, over: int = DEFAULT_OVER,
                       max_speed: float = math.inf, max_turn_rate: float = math.inf,
                       reach: float = 0.0, prefer: Sequence[str] = (),
                       steady: int = DEFAULT_STEADY) -> None:
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
        :raises InvalidArgumentException: an edge without sources, or an invalid limit.

        One stamp in the far future makes all other sources silent: set ``max_future`` to
        refuse such stamps.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        self._switching().switch_by_rule(child, checked_rule(
            max_age, gate, window, limits, prefer, steady))
