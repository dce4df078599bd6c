# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Choose among four explanations: nothing is wrong, the edge, the time, or both; and the result.

All are fitted, and compared by the Bayesian information criterion (Schwarz, Annals of Statistics
6(2), 1978). Its number of observations is that of independent ones: the residuals of successive
detections are correlated, and a hundred may carry no more information than ten. So the
log-likelihood is divided by the correlation time, as QAIC divides it by the overdispersion
(Burnham and Anderson, "Model Selection and Multimodel Inference", 2.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core import Pose

from .at_rest import Contradiction
from .model import Model, Unknowns
from .observability import free_steps, held_directions
from .observations import Array, Mask
from .precision import Precision
from .solve import Fit, fitted
from .unobservable import Unobservable

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


_FREE = {Verdict.NOTHING: (False, False), Verdict.EDGE: (True, False),
         Verdict.TIME: (False, True), Verdict.BOTH: (True, True)}
"""Whether edges and whether offsets are estimated."""


def explanations(model: Model, full: Fit, sure: Precision,
                 inliers: Sequence[Mask]) -> list[Explanation]:
    """
    Return all four explanations, fitted to the same observations with the same spread.

    Each explanation holds its own unobservable directions: where a shifted mounting and a delay
    look the same, each of them alone is observable.

    :param full: the fit with edges and times.
    :param sure: its precision.
    :param inliers: of each set, which observations are not outliers.
    """
    made, time, numbers = [], sure.correlation_time, float(full.sizes.sum())
    for name, free in _FREE.items():
        steps = free_steps(model, held_directions(
            model, full.state, sure.information, _free(model, *free)))
        fit = full if all(free) else fitted(
            model, full.state, steps, full.covariances, _ACCURACY)
        count, step = steps.shape[1], model.unknowns.step_to(full.state, fit.state)
        misfit = sure.likelihood_ratio(step, fit.cost - full.cost)
        made.append(Explanation(
            name, misfit + _penalty(count, numbers, time), misfit, count,
            *_unexplained(fit, inliers), tuple(fit.state.offsets.tolist())))
    return made


def _penalty(count: int, numbers: float, correlation_time: float) -> float:
    """
    Return the penalty for some unknowns of so many numbers.

    With few numbers, it is larger than Schwarz's: McQuarrie, "A small-sample correction for the
    Schwarz SIC model selection criterion", Statistics & Probability Letters 44, 1999.
    """
    few = numbers / max(numbers - count - 2.0, 1.0)
    return count * few * math.log(max(numbers / correlation_time, 2.0))


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
        blind = sum(each.kind in ('translation', 'rotation') and each.product_with is None
                    for each in hidden) >= _HIDDEN
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


# --- the result

class EdgeEstimate(NamedTuple):
    """
    An edge before and after.

    :ivar before: ``parent_T_child`` in the tree.
    :ivar after: ``parent_T_child`` by the estimate.
    :ivar covariance: (6, 6) of ``after``, in the convention of ``PoseWithCovariance`` and
        ``insert``.
    """

    parent: str
    child: str
    before: Pose
    after: Pose
    covariance: Array

    @property
    def moved_m(self) -> float:
        """Return the distance between the two origins of the child, metres."""
        return math.dist(self.before[:3], self.after[:3])

    @property
    def turned_rad(self) -> float:
        """Return the angle between the two rotations of the child."""
        turn = (self.before.inverse() @ self.after).as_rotation_vector()
        return math.hypot(*turn)


class TimeOffset(NamedTuple):
    """
    The time offset of a sensor in seconds: positive if its stamps are later than the truth.

    :ivar sigma_s: the standard deviation of the offset.
    :ivar at_bound: whether the offset is the largest that was tried: the true one may be larger.
    :ivar jitter_s: the standard deviation of single stamps about the offset; 0 if none is visible.
    """

    sensor: str
    offset_s: float
    sigma_s: float
    at_bound: bool = False
    jitter_s: float = 0.0


class Outlier(NamedTuple):
    """
    An observation that contradicts the others.

    :ivar sigmas: its distance from the estimate, in standard deviations.
    """

    stamp: int
    sensor: str
    target: str
    sigmas: float


class Trace(NamedTuple):
    """
    The errors of the observations before and after, in order of time.

    :ivar stamps: (N,) nanoseconds.
    :ivar speed: (N,) of the target past the sensor, metres a second.
    :ivar before_m: (N,) errors with the edges of the tree and without a time offset, metres.
    :ivar after_m: (N,) errors with the estimate, metres.
    """

    stamps: Array
    speed: Array
    before_m: Array
    after_m: Array


@dataclass(frozen=True)
class Calibration:
    """
    The result of ``calibrate``.

    :ivar edges: the edges, in the order of the arguments.
    :ivar time_offsets: one for each sensor; empty without ``time``.
    :ivar verdict: what is wrong.
    :ivar contradiction: why the observations do not fit one target at rest; None: they may. If
        they do not, the edges and offsets are those of the tree.
    :ivar explanations: all four, with the errors that each leaves unexplained.
    :ivar unobservable: the directions that the observations do not show; these keep the value
        of the tree.
    :ivar outliers: the outliers, by stamp.
    :ivar observations: how many observations were used.
    :ivar places: ``fixed_in_T_target`` of each estimated target, by (fixed_in, name).
    :ivar correlation_time: how many successive observations carry as much information as one.
    :ivar covariance: (Q, Q) of all edges and then all offsets together.
    :ivar trace: the errors of the observations, for pictures.
    """

    edges: Sequence[EdgeEstimate]
    time_offsets: Sequence[TimeOffset]
    verdict: Verdict
    contradiction: Contradiction | None
    explanations: Sequence[Explanation]
    unobservable: Sequence[Unobservable]
    outliers: Sequence[Outlier]
    observations: int
    places: dict[tuple[str, str], Pose]
    correlation_time: float
    covariance: Array
    trace: Trace

    @property
    def edge(self) -> EdgeEstimate:
        """Return the first edge."""
        return self.edges[0]

    @property
    def time_offset_s(self) -> float | None:
        """Return the offset of the first sensor; None without ``time``."""
        return self.time_offsets[0].offset_s if self.time_offsets else None

    @property
    def time_offset_sigma_s(self) -> float | None:
        """Return the standard deviation of ``time_offset_s``."""
        return self.time_offsets[0].sigma_s if self.time_offsets else None

    @property
    def all_at_one_place(self) -> bool:
        """Return whether no direction of any edge, and no time offset, is observable."""
        sensors = len(self.explanations[0].offsets)
        return len(self.unobservable) >= 6 * len(self.edges) + sensors

    @property
    def wants_new_edge(self) -> bool:
        """Return whether an edge is wrong by the verdict."""
        return self.verdict in (Verdict.EDGE, Verdict.BOTH)

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain data for JSON."""
        edges = [_plain_edge(each) for each in self.edges]
        return {
            'verdict': self.verdict.value,
            'contradiction': self.contradiction and self.contradiction._asdict(),
            'edge': edges[0],
            'edges': edges,
            'time_offset_s': self.time_offset_s,
            'time_offset_sigma_s': self.time_offset_sigma_s,
            'time_offsets': [each._asdict() for each in self.time_offsets],
            'explanations': [_plain_explanation(each) for each in self.explanations],
            'unobservable': [each._asdict() | {'axis': list(each.axis)}
                             for each in self.unobservable],
            'outliers': [{'stamp_ns': each.stamp, 'sensor': each.sensor, 'target': each.target,
                          'sigmas': each.sigmas} for each in self.outliers],
            'observations': self.observations,
            'correlation_time': self.correlation_time,
            'targets': [{'fixed_in': fixed_in, 'target': target, 'place': _numbers(place)}
                        for (fixed_in, target), place in self.places.items()],
        }


def _plain_edge(edge: EdgeEstimate) -> dict[str, object]:
    return {'parent': edge.parent, 'child': edge.child, 'before': _numbers(edge.before),
            'after': _numbers(edge.after), 'covariance': edge.covariance.tolist()}


def _plain_explanation(each: Explanation) -> dict[str, object]:
    return {'name': each.name.value, 'criterion': each.criterion, 'misfit': each.misfit,
            'free': each.free,
            'unexplained_m': each.unexplained_m,
            'unexplained_rad': None if math.isnan(each.unexplained_rad)
            else each.unexplained_rad,
            'time_offset_s': each.offsets[0]}


def _numbers(pose: Pose) -> dict[str, float]:
    return dict(zip(('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'), map(float, pose), strict=True))
