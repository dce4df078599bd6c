# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Choose among four explanations: nothing is wrong, the edge, the time, or both.

All are fitted, and compared by the Bayesian information criterion (Schwarz, Annals of Statistics
6(2), 1978). Its number of observations is that of independent ones: the residuals of successive
detections are correlated, and a hundred may carry no more information than ten. So the
log-likelihood is divided by the correlation time, as QAIC divides it by the overdispersion
(Burnham and Anderson, "Model Selection and Multimodel Inference", 2.5).
"""

from collections.abc import Sequence
from enum import Enum
import math
from typing import NamedTuple

import numpy as np

from .model import Model
from .observability import (
    at_the_tree,
    free_basis,
    held_directions,
    Limits,
    Unobservable,
)
from .observations import Array, Mask
from .solve import Fit, fitted, Precision
from .spread import inflation
from .unknowns import State, Unknowns

_SURE = 6.0
"""A difference of the criterion from which one of two explanations is strongly preferred (Kass
and Raftery, "Bayes Factors", JASA 90, 1995)."""
_ACCURACY = 1e-4
_HIDDEN = 3
"""With this many directions that are not observable, an edge may be wrong unnoticed."""


class Verdict(str, Enum):
    """What is wrong."""

    NOTHING = 'nothing'
    EDGE = 'edge'
    TIME = 'time'
    BOTH = 'edge and time'
    UNKNOWN = 'cannot tell'

    def __str__(self) -> str:
        return self.value


class Explanation(NamedTuple):
    """
    One explanation, and the errors that it leaves unexplained.

    :ivar name: what is wrong.
    :ivar criterion: lower is better; only differences have a meaning.
    :ivar misfit: the criterion without the penalty for the number of unknowns.
    :ivar free: how many directions are estimated.
    :ivar unexplained_m: the remaining error of the target's position, root mean square without
        outliers, metres.
    :ivar unexplained_rad: likewise of its rotation, radians; NaN for points.
    :ivar offsets: the time offset of each sensor, seconds.
    """

    name: Verdict
    criterion: float
    misfit: float
    free: int
    unexplained_m: float
    unexplained_rad: float
    offsets: tuple[float, ...]


FREE = {Verdict.NOTHING: (False, False), Verdict.EDGE: (True, False),
        Verdict.TIME: (False, True), Verdict.BOTH: (True, True)}
"""Whether edges and whether offsets are estimated."""


def explanations(model: Model, tree: State, full: Fit, sure: Precision,
                 inliers: Sequence[Mask], limits: Limits) -> list[Explanation]:
    """
    Return all four explanations, fitted to the same observations with the same spread.

    Each explanation holds its own unobservable directions: where a shifted mounting and a delay
    look the same, each of them alone is observable.

    :param full: the fit with edges and times.
    :param sure: its precision.
    :param inliers: of each set, which observations are not outliers.
    """
    made, correlation_time = [], sure.correlation_time
    scale = max(inflation(np.concatenate(full.distances), full.sizes), 1e-9)
    for name, free in FREE.items():
        without = held_directions(model, full.state, sure.information,
                                  _free(model, *free), limits)
        begin = at_the_tree(model.unknowns, tree, full.state, without, limits)
        basis = free_basis(model.unknowns, without, limits)
        fit = full if all(free) else fitted(
            model, begin, basis, full.covariances, _ACCURACY)
        numbers = fit.sizes.sum() / correlation_time
        misfit, count = fit.cost / (correlation_time * scale), basis.shape[1]
        made.append(Explanation(
            name, misfit + count * math.log(max(numbers, 2.0)), misfit, count,
            *_unexplained(fit, inliers), tuple(fit.state.offsets.tolist())))
    return made


def judged(found: Sequence[Explanation], hidden: Sequence[Unobservable],
           unknowns: Unknowns) -> Verdict:
    """Return the explanation that holds, if the observations show it."""
    criterion = {each.name: each.criterion for each in found}
    best = min(criterion, key=lambda name: criterion[name])
    no_edge = sum(each.kind != 'time' for each in hidden) >= 6 * len(unknowns.edges)
    no_time = any(each.kind in ('time', 'both') for each in hidden)
    if no_edge and no_time:
        return Verdict.UNKNOWN
    if best is Verdict.NOTHING:
        blind = sum(each.kind in ('translation', 'rotation') for each in hidden) >= _HIDDEN
        return Verdict.UNKNOWN if no_time or blind else best
    return Verdict.UNKNOWN if best is not Verdict.BOTH and _alike(found) else best


def _alike(found: Sequence[Explanation]) -> bool:
    """
    Return whether the edge alone and the time alone fit equally well.

    Neither is a special case of the other, so the simpler of the two is not preferred. Each
    additional unknown of the edge may reduce the misfit by one, by fitting noise.
    """
    edge, time = (next(each for each in found if each.name is name)
                  for name in (Verdict.EDGE, Verdict.TIME))
    return -_SURE < time.misfit - edge.misfit < _SURE + max(edge.free - time.free, 0)


def _free(model: Model, edges: bool, times: bool) -> Mask:
    """Return the numbers of edges and offsets (Q,) that an explanation estimates."""
    free = np.full(model.unknowns.of_interest, edges)
    free[model.unknowns.times] = times and model.reach > 0.0
    return free


def _unexplained(fit: Fit, inliers: Sequence[Mask]) -> tuple[float, float]:
    moved = np.concatenate([each[kept, :3] for each, kept
                            in zip(fit.residuals, inliers, strict=True)])
    turned = [each[kept, 3:] for each, kept in zip(fit.residuals, inliers, strict=True)
              if each.shape[1] == 6]
    return _rms(moved), _rms(np.concatenate(turned)) if turned else math.nan


def _rms(residuals: Array) -> float:
    return float(np.sqrt((residuals ** 2).sum(axis=1).mean())) if len(residuals) else math.nan
