# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the samples of an edge show about the errors of its predictions, which is cached.

It has two parts: the errors of earlier predictions, and the largest accelerations.
"""

from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.stamp import BEGINNING, FOREVER, mean_interval, NANOSECONDS_PER_SECOND
from tf_tree_py.core.tree.companions import Companion

from .accelerations import deviations, LearntLimits, Limits
from .trials import (
    check_size,
    LATELY,
    Packed,
    Start,
    times,
    Trials,
    TWIST_OVER,
    unchanged_until,
)
from ..uncertainty.covariances import DIAGONAL

_DIAGONAL: tuple[int, ...] = tuple(DIAGONAL.tolist())


class PastCache(Companion):
    """
    The cached past of edges.

    :ivar by_child: that of each edge that was predicted, by its child frame.
    """

    def __init__(self) -> None:
        self.by_child: dict[str, Past] = {}

    def structure_changed(self) -> None:
        """
        Remove all: a prediction is made from samples with the newest parent.

        A late sample of an edge that has had other parents changes the structure, too.
        """
        self.by_child.clear()

    def of(self, history: MovingHistory) -> 'Past':
        """Return the past of an edge; that of a curve, which may be replaced, is new."""
        if not history.takes_samples:
            return Past(history)
        known = self.by_child.get(history.child)
        if known is None:
            known = self.by_child[history.child] = Past(history)
        elif history.late != FOREVER:
            known.forget(history, history.late)
        history.late = FOREVER
        return known


class Past:
    """
    The earlier predictions of one edge, and its accelerations.

    It depends only on the samples, not on the times of the calls.
    """

    __slots__ = ('_since', '_trials', '_limits')

    def __init__(self, history: MovingHistory) -> None:
        self._since = _begin(history)
        self._trials = Trials()
        self._limits = LearntLimits()

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all that a sample that was inserted before the newest one may have changed."""
        self._limits.forget(late)
        self._trials.forget(unchanged_until(history, late))

    def covariance(self, history: MovingHistory, start: Start, ahead: int, until: int,
                   given: Limits | None) -> Packed:
        """
        Return the covariance of a prediction's errors, in the axes of the predicted pose.

        The variances of both parts are added: noise does not prevent an edge from accelerating.

        :param start: at the newest sample.
        :param ahead: nanoseconds.
        :param until: the stamp up to which the edge's gyroscope is followed.
        :param given: the largest accelerations; None: learnt.
        """
        oldest, period = history.oldest_stamp, 0.0
        assert oldest is not None
        if history.takes_samples:
            period = mean_interval(start.stamp - oldest, len(history))
        second = float(NANOSECONDS_PER_SECOND)
        limits = self._limits.largest(
            history, max(oldest, self._since), start.stamp) if given is None else given
        errors = deviations(
            times(start.twist, second), limits, given is None, max(period, TWIST_OVER) / second,
            ahead / second, (until - start.stamp) / second)
        check_size(history, max(errors))
        covariance = self._trials.moment(history, start, ahead, until, period)
        for index, error in zip(_DIAGONAL, errors, strict=True):
            covariance[index] += error * error
        return covariance


def _begin(history: MovingHistory) -> int:
    """Return the stamp since which an edge has its parent; a curve is only learnt from lately."""
    if history.newest_stamp is None or not history.takes_samples:
        return (history.newest_stamp or 0) - LATELY
    if history.fixed_parent:
        return BEGINNING
    *_, (_, begin, _) = history.parents_between(BEGINNING, history.newest_stamp + 1)
    return begin
