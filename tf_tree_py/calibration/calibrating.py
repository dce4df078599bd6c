# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``calibrate``: estimate edges and time offsets from observations, and judge what is wrong."""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core import Pose

from .at_rest import contradiction
from .chain import check_edges, Edge, Tree
from .model import Model, State
from .observability import covariance_of, fixed, free_steps, Held, held_directions
from .observations import Array, CalibrationError, Limits, Observations
from .precision import Precision, precision
from .solve import Fit, fitted, is_at_bound, roughly, settled
from .spread import are_outliers
from .start import some_of, starts
from .unobservable import described, Unobservable
from .verdict import (
    Calibration,
    EdgeEstimate,
    explanations,
    judged,
    Outlier,
    TimeOffset,
    Trace,
    Verdict,
)

_LEAST = 3
_LEAST_REACH_S = 0.01
"""Where the transforms allow only smaller shifts of the stamps, they are not shifted."""
_STEP_S = 0.1
"""The distance between the offsets that the search begins with."""
_LOOKS = 3
"""How often what is not observable is sought, each time at a better estimate."""
_ROUGHLY = 1e-3


class _Estimate(NamedTuple):
    """
    A fit of the observable directions, and its precision.

    :ivar steps: (P, F) a basis of the steps that the fit could take.
    """

    model: Model
    fit: Fit
    steps: Array
    held: Held
    precision: Precision


def calibrate(tree: Tree, edges: Edge | Sequence[Edge],
              observations: Observations | Sequence[Observations], *, time: bool = False,
              limits: Limits | None = None) -> Calibration:
    """
    Estimate static edges from observations, and judge whether the edges or the stamps are wrong.

    The edges and the unknown places of the targets are estimated together; with ``time``, so
    are the time offsets of the sensors. The verdict always compares all four explanations,
    with ``time`` or without.

    :param tree: a buffer, or the result of ``open_bag``.
    :param edges: (parent, child) of a static edge, or several.
    :param observations: those of one target by one sensor, or several sets.
    :param time: whether to estimate the time offsets of the stamps.
    :param limits: what counts as observable, and the largest time offset.
    :raises CalibrationError: an edge does not exist or is not static, a frame does not exist,
        or there are too few observations.
    """
    pairs = _pairs(edges)
    sets = [observations] if isinstance(observations, Observations) else list(observations)
    limits = Limits() if limits is None else limits
    check_edges(tree, pairs)
    _check(sets)
    model = Model(tree, pairs, sets, limits)
    full = _estimated(_in_reach(model, limits.max_offset_s), True)
    wanted = full if time else _estimated(_in_reach(model, 0.0), False, full.fit.state)
    return _result(full, wanted, time)


def _pairs(edges: Any) -> list[Edge]:
    single = len(edges) == 2 and all(isinstance(each, str) for each in edges)
    return [(parent, child) for parent, child in ([edges] if single else edges)]


def _check(sets: Sequence[Observations]) -> None:
    if not sets or not any(map(len, sets)):
        names = ', '.join(repr(each.target) for each in sets) or 'the target'
        raise CalibrationError(f'{names} was never seen: there are no observations')
    count = sum(map(len, sets))
    if count < _LEAST:
        raise CalibrationError(f'{count} observations are too few: at least {_LEAST} from '
                               'different places are needed, and some hundred are better')


def _in_reach(model: Model, reach: float) -> Model:
    """
    Return a model of the observations whose stamps may be shifted by this many seconds.

    :raises CalibrationError: the tree has transforms for too few of them.
    """
    while True:
        shifts = {round(1e9 * each) for each in np.linspace(-reach, reach, 9)}
        kept = [np.all([ways.valid(shift) for shift in shifts], axis=0)
                for _, ways in model.seen]
        found, there = sum(int(each.sum()) for each in kept), len(model)
        if found >= max(_LEAST, there // 2) or not reach:
            break
        reach = reach / 2.0 if reach > _LEAST_REACH_S else 0.0
    if found < _LEAST:
        raise CalibrationError(
            f'the tree has transforms for {found} of {there} observations, and at least {_LEAST} '
            'are needed: check that all stamps come from the same clock, and that /tf and the '
            'observations were recorded together')
    return model.chosen(kept, reach)


def _estimated(model: Model, time: bool, near: State | None = None) -> _Estimate:
    """Return the estimate; directions that are not observable keep the values of the tree."""
    count = model.unknowns.of_interest
    edges = 6 * len(model.unknowns.edges)
    free = np.array([number < edges or (time and model.reach > 0.0) for number in range(count)])
    few = some_of(model)  # the search costs less with few
    begins = _begins(few, time)
    if near is not None:
        begins.append(near._replace(offsets=model.tree_values.offsets))
    held = fixed(free)
    steps = free_steps(model, held)
    tried = [roughly(few, begin, steps) for begin in begins]
    best = min(tried, key=lambda fit: fit.cost)
    begin = best.state if len(few) == len(model) else settled(few, best.state, steps).state
    fit = settled(model, begin, steps)
    for _ in range(_LOOKS):
        before, sure = held, precision(model, fit, steps)
        held = held_directions(model, fit.state, sure.information, free)
        if held.size == before.size:
            return _Estimate(model, fit, steps, before, sure)
        steps = free_steps(model, held)
        fit = settled(model, fit.state, steps)
    return _Estimate(model, fit, steps, held, precision(model, fit, steps))


def _nothing_estimated(estimate: _Estimate) -> _Estimate:
    """Return an estimate with the tree's values of all edges and offsets."""
    model = estimate.model
    held = fixed(np.zeros(model.unknowns.of_interest, dtype=bool))
    steps = free_steps(model, held)
    fit = fitted(model, estimate.fit.state, steps, estimate.fit.covariances, _ROUGHLY)
    fit = fit._replace(jitters_s=(0.0,) * len(model.seen))
    return _Estimate(model, fit, steps, held, precision(model, fit, steps))


def _begins(model: Model, time: bool) -> list[State]:
    steps = int(model.reach / _STEP_S) if time else 0
    return starts(model, [number * _STEP_S for number in range(-steps, steps + 1)])


def _result(full: _Estimate, wanted: _Estimate, time: bool) -> Calibration:
    unknowns = full.model.unknowns
    sizes = [each.observations.size for each in full.model.seen]
    inliers = [~are_outliers(far, np.full(len(far), float(size)))
               for far, size in zip(full.fit.distances, sizes, strict=True)]
    seen_together = described(full.model, full.held)
    hidden = seen_together if time else _without_time(wanted, seen_together)
    against = contradiction(full.model, full.fit, full.steps)
    if against is not None:
        wanted = _nothing_estimated(wanted)
    found = explanations(full.model, full.fit, full.precision, inliers)
    covariance = covariance_of(full.model, wanted.fit.state, wanted.precision.covariance,
                               wanted.held)
    edges = [
        EdgeEstimate(*edge, Pose(*before.tolist()), Pose(*after.tolist()),
                     covariance[unknowns.edge(number), unknowns.edge(number)])
        for number, (edge, before, after) in enumerate(zip(
            unknowns.edges, full.model.tree_values.edges, wanted.fit.state.edges, strict=True))]
    offsets = [
        TimeOffset(sensor, float(wanted.fit.state.offsets[number]),
                   math.sqrt(covariance[unknowns.offset(sensor), unknowns.offset(sensor)]),
                   is_at_bound(float(wanted.fit.state.offsets[number]), wanted.model.reach),
                   _jitter_of(wanted, sensor))
        for number, sensor in enumerate(unknowns.sensors)] if time else []
    verdict = Verdict.UNKNOWN if against else judged(found, seen_together, unknowns)
    return Calibration(
        edges, offsets, verdict, against, found, hidden, _outliers(wanted), len(wanted.model),
        {target: Pose(*place.tolist()) for target, place
         in zip(unknowns.targets, wanted.fit.state.places, strict=True)},
        wanted.precision.correlation_time, covariance, _trace(wanted))


def _without_time(wanted: _Estimate, together: Sequence[Unobservable]) -> list[Unobservable]:
    """
    Return what an estimate without time offsets does not show.

    :param together: what one with offsets does not show.
    """
    return [*(each for each in described(wanted.model, wanted.held) if each.kind != 'time'),
            *(each for each in together if each.kind in ('time', 'both'))]


def _jitter_of(estimate: _Estimate, sensor: str) -> float:
    """Return the jitter of a sensor's stamps: the largest that one of its targets shows."""
    return max(jitter for (each, _), jitter in zip(
        estimate.model.seen, estimate.fit.jitters_s, strict=True) if each.sensor == sensor)


def _outliers(estimate: _Estimate) -> list[Outlier]:
    found = []
    for (each, _), distance in zip(estimate.model.seen, estimate.fit.distances, strict=True):
        for place in np.flatnonzero(are_outliers(distance, np.full(len(distance), each.size))):
            found.append(Outlier(int(each.stamps[place]), each.sensor, each.target,
                                 math.sqrt(float(distance[place]))))
    return sorted(found)


def _trace(estimate: _Estimate) -> Trace:
    model, fit = estimate.model, estimate.fit
    before = _nothing_estimated(estimate).fit
    stamps = np.concatenate([each.stamps for each, _ in model.seen])
    order = np.argsort(stamps, kind='stable')
    far, near = (np.concatenate([np.linalg.norm(each[:, :3], axis=1) for each in residuals])
                 for residuals in (before.residuals, fit.residuals))
    speed = np.concatenate([np.linalg.norm(model.velocity(number, fit.state)[:, :3], axis=1)
                            for number in range(len(model.seen))])
    return Trace(stamps[order], speed[order], far[order], near[order])
