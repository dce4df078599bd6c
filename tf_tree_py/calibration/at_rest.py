# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Find out whether the observations are of one target at rest.

Before any explanation is chosen, the best one has to explain. There are three ways in which it
may not, each with a test on the fit of edges and times:

- The observations have nothing to do with the motion of the tree. The regression of what was
  observed on what is predicted has the slope one if they have, and zero if they have not. Or more
  is left than any detector errs by, and than the prediction explains.
- The target moves. A motion with a few frequencies, added to the model, explains far more than
  chance does (F test), and is large beside the motion of the sensor. Odometry drifts too, but by
  some hundredths of the distance.
- There are two targets. Of two places, each is that of many observations, in turns, and they are
  much farther apart than the observations of each.
"""

from collections.abc import Callable
import math
from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc
from tf_tree_py.core import se3
from tf_tree_py.core.geometry import so3

from .model import as_poses, between_many, Model
from .observations import Array, Mask, Observations
from .solve import Fit, is_at_bound
from .spread import are_outliers, weight, whitening

NOT_AT_REST = 'the observations do not fit one target at rest'
_LEAST = 8
"""Fewer observations of a target contradict nothing."""
_HALF, _SURE = 0.5, 0.2
"""The slope below which the observations are unrelated, and its largest standard error."""
_NO_DETECTOR, _NO_DETECTOR_RAD = 0.2, 0.5
"""No detector errs by so much of the distance, or so many radians, root mean square."""
_CHANCE = 1e-6
_WAVES = 16
"""The largest number of half waves in the motion of a target, over the whole recording."""
_FREE = 3
"""The motion has at most one unknown for so many numbers that are left."""
_BESIDE, _PER_DISTANCE = 0.2, 0.1
"""A target that moves less than this, relative to the extent of the motion of the sensor and to
its speed, may be drift of the tree."""
_OF_DISTANCE, _LEAST_RAD = 0.02, 0.1
"""Detectors err by so much of the distance, and radians, and may err slowly."""
_DENSE, _MANY = 0.15, 0.25
"""The share of the observations in the radius of a place, and the least share elsewhere."""
_APART, _PLACES_OF_DISTANCE, _CHANGES = 5.0, 0.06, 4
"""The least distance of two places, in radii and of the distance to the sensor, and how often two
targets are seen in turns."""
_MOST = 150
_CONFUSED = ('check whether the detector confuses two rotations of a flat target: publish points '
             'then, as PointStamped')


class Contradiction(NamedTuple):
    """
    Why the observations are not of one target at rest.

    :ivar what: in words.
    :ivar remedy: what to do.
    """

    what: str
    remedy: str


def contradiction(model: Model, fit: Fit, steps: Array) -> Contradiction | None:
    """
    Return why the observations of one target do not fit the model; None: they may.

    :param fit: the best fit, with edges and times.
    :param steps: (P, F) a basis of the steps that the fit may take.
    """
    for number, (each, _) in enumerate(model.seen):
        if len(each) >= _LEAST:
            found = (_unrelated(model, fit, number, _does_not_follow)
                     or _moving(model, fit, steps, number) or _two_places(model, fit, number)
                     or _unrelated(model, fit, number, _is_unlikely))
            if found is not None:
                if len(model.seen) > 1:
                    found = found._replace(remedy=f'{found.remedy}; or leave {each.target!r} out')
                return _within_bounds(model, fit, each.sensor, found)
    return None


def _within_bounds(model: Model, fit: Fit, sensor: str, found: Contradiction) -> Contradiction:
    """Return a contradiction with one more remedy, because a larger time offset may explain it."""
    offset = float(fit.state.offsets[model.unknowns.sensors.index(sensor)])
    if not is_at_bound(offset, model.reach):
        return found._replace(remedy=f'{found.remedy}; if the stamps may be later than '
                                     f'{model.reach:.3g} s, try a larger --max-offset')
    return found._replace(remedy=(
        f'try a larger --max-offset, because the time of {sensor} is at its bound of '
        f'{model.reach:.3g} s; otherwise, {found.remedy}'))


def _weights(fit: Fit, number: int) -> Array:
    """
    Return the weights (N,) of a set, also if its given covariances are far too small.

    Outliers have none, because a detector may see a target turned over for seconds.
    """
    distances, size = fit.distances[number], float(fit.residuals[number].shape[1])
    weights = weight(distances / max(float(np.median(distances)) / size, 1.0), size)
    return np.where(are_outliers(distances, np.full(len(distances), size)), 0.0, weights)


# --- unrelated

class _Agreement(NamedTuple):
    """
    How what was seen agrees with the prediction: weighted means of squares.

    :ivar seen: of what was seen, about its mean.
    :ivar predicted: of the prediction, about its mean.
    :ivar left: of their difference, about its mean.
    :ivar along: of their product.
    :ivar size: the number of observations.
    :ivar most: the square of the largest error of any detector.
    """

    seen: float
    predicted: float
    left: float
    along: float
    size: int
    most: float


def _does_not_follow(found: _Agreement) -> bool:
    """Return whether the slope is below one half, and precise enough to exclude one."""
    # Positions and rotations vary in about three directions.
    sure = found.left < 3 * found.size * _SURE ** 2 * found.predicted
    return sure and found.along < _HALF * found.predicted


def _is_unlikely(found: _Agreement) -> bool:
    """Return whether more is left than any detector errs by, and than is explained."""
    return found.left > max(found.most, _HALF * found.seen)


def _unrelated(model: Model, fit: Fit, number: int,
               contradicts: Callable[[_Agreement], bool]) -> Contradiction | None:
    each = model.seen[number].observations
    weights = _weights(fit, number)
    predicted = model.placed(number, fit.state).pose
    distance = float(np.median(np.linalg.norm(each.seen[:, :3], axis=1)))
    if contradicts(_agreement(each.seen[:, :3], predicted[:, :3], weights,
                              _NO_DETECTOR * distance)):
        return Contradiction(
            f'{NOT_AT_REST}: what {each.sensor} saw of {each.target!r} does not move as the tree '
            'predicts', 'check that the transforms and the observations are of the same run, '
            f'that header.frame_id names the right sensor, and that the target rests in '
            f'{each.fixed_in}')
    if each.size == 6 and contradicts(_agreement(_turns(each.seen), _turns(predicted), weights,
                                                 _NO_DETECTOR_RAD)):
        return Contradiction(
            f'{NOT_AT_REST}: the rotations that {each.sensor} saw of {each.target!r} do not turn '
            'as the tree predicts', 'check that the detector measures rotations: if it does not, '
            'publish points, as PointStamped')
    return None


def _agreement(seen: Array, predicted: Array, weights: Array, most: float) -> _Agreement:
    """Return the agreement of (N, p) each; ``most``: the largest error of any detector."""
    share = weights / weights.sum()
    seen, predicted = seen - share @ seen, predicted - share @ predicted
    left = seen - predicted
    there, power, rest, along = (float(share @ (one * other).sum(axis=1)) for one, other in (
        (seen, seen), (predicted, predicted), (left, left), (seen, predicted)))
    return _Agreement(there, power, rest, along, len(seen), most ** 2)


def _turns(poses: Array) -> Array:
    """Return rotations as vectors (N, 9) whose small differences have the size of the angle."""
    return so3.as_matrix_many(poses[:, 3:]).reshape(-1, 9) / math.sqrt(2.0)


# --- a target that moves

def _moving(model: Model, fit: Fit, steps: Array, number: int) -> Contradiction | None:
    each = model.seen[number].observations
    motion = _motion(model, fit, steps, number)
    if motion is None:
        return None
    sensor = model.placed(number, fit.state).fixed_T_sensor
    distance = float(np.median(np.linalg.norm(each.seen[:, :3], axis=1)))
    said = []
    if _is_large(motion[:, :3], sensor[:, :3], _OF_DISTANCE * distance):
        said.append(f'by {_span(motion[:, :3]):.2g} m, at about '
                    f'{_path(motion[:, :3]) / _seconds(each):.2g} m/s')
    if _is_large(motion[:, 3:], _turns(sensor), _LEAST_RAD):
        said.append(f'by {math.degrees(_span(motion[:, 3:])):.2g} degrees')
    if not said:
        return None
    slow = _path(motion[:, :3]) < _PER_DISTANCE * _path(sensor[:, :3])
    remedy = ('fasten the target, or name the frame that it moves with as --fixed-in; check the '
              'size of the target that the detector assumes; if the tree drifts between '
              f'{each.fixed_in} and {each.sensor}, as odometry does, use a shorter recording')
    return Contradiction(
        f'{NOT_AT_REST}: {each.target!r} moves in {each.fixed_in}{", or the tree drifts" * slow}, '
        f'{" and ".join(said)}', remedy if 'm/s' in said[0] else f'{_CONFUSED}; {remedy}')


def _motion(model: Model, fit: Fit, steps: Array, number: int) -> Array | None:
    """
    Return the motion of a target (N, 3 or 6), metres and radians in its fixed frame.

    It is what the fit leaves: the least motion, since a wrong mounting may hide a part of it. It
    is None if there is no more than chance explains, or than another mounting or time would.
    """
    each = model.seen[number].observations
    rows = np.sqrt(_weights(fit, number))[:, None, None] * whitening(fit.covariances[number])
    left = np.einsum('nij,nj->ni', rows, fit.residuals[number]).ravel()
    place = rows @ model.by_place(number, fit.state)
    at_rest = place.reshape(len(left), -1)
    rest = np.hstack([at_rest, (rows @ model.derivatives(number, fit.state)).reshape(
        len(left), -1) @ steps])
    waves = _waves(each, (len(left) - rest.shape[1]) // (_FREE * each.size))
    if not waves.shape[1]:
        return None
    moved = np.einsum('nij,nk->nikj', place, waves).reshape(len(left), -1)
    before, after = (_solved(columns, left)[1] for columns in (rest, np.hstack([rest, moved])))
    count, free = moved.shape[1], len(left) - rest.shape[1] - moved.shape[1]
    ratio = (before - after) / count / max(after / free, 1e-300)
    if fdtrc(count, free, max(ratio, 0.0)) > _CHANCE:
        return None
    amplitudes = _solved(np.hstack([at_rest, moved]), left)[0][at_rest.shape[1]:]
    return np.asarray(waves @ amplitudes.reshape(waves.shape[1], each.size))


def _waves(each: Observations, most: int) -> Array:
    """Return half waves (N, K) over the time of some observations."""
    phases = np.pi * 1e-9 * (each.stamps - each.stamps[0]) / _seconds(each)
    return np.cos(np.outer(phases, np.arange(1, min(most, _WAVES) + 1)))


def _seconds(each: Observations) -> float:
    return max(1e-9 * float(each.stamps[-1] - each.stamps[0]), 1e-9)


def _solved(columns: Array, left: Array) -> tuple[Array, float]:
    """Return the steps that explain residuals (M,) best, and the sum of squares that is left."""
    steps = np.linalg.lstsq(columns, -left, rcond=1e-10)[0]
    return steps, float(((columns @ steps + left) ** 2).sum())


def _is_large(motion: Array, beside: Array, least: float) -> bool:
    """Return whether a motion (N, p) is large, also beside the motion of the sensor (N, q)."""
    return _extent(motion) > least and (_extent(motion) > _BESIDE * _extent(beside)
                                        or _path(motion) > _PER_DISTANCE * _path(beside))


def _extent(motion: Array) -> float:
    """Return the root mean square distance from the mean, of (N, p)."""
    return float(np.sqrt(((motion - motion.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _path(motion: Array) -> float:
    """Return the length of the polyline through (N, p)."""
    return float(np.linalg.norm(np.diff(motion, axis=0), axis=1).sum())


def _span(motion: Array) -> float:
    """Return the diagonal of the box around a motion (N, 3)."""
    return float(np.linalg.norm(np.ptp(motion, axis=0)))


# --- two targets

def _two_places(model: Model, fit: Fit, number: int) -> Contradiction | None:
    each = model.seen[number].observations
    some = np.linspace(0, len(each) - 1, min(len(each), _MOST)).astype(int)
    sensor = model.placed(number, fit.state).fixed_T_sensor[some]
    places = se3.compose_many(sensor, as_poses(each.seen[some]))
    apart = _distances(places, each.size)
    radii = np.maximum(np.quantile(apart, _DENSE, axis=1), 1e-9)
    first = int(radii.argmin())
    elsewhere = apart[first] > _APART * radii[first]
    second = int((elsewhere * apart[first] / radii).argmax())
    if elsewhere.mean() < _MANY or apart[first, second] < _APART * radii[second]:
        return None
    step = between_many(places[first][None], places[second][None])[0]
    moved, turned = (float(np.linalg.norm(each)) for each in (step[:3], step[3:each.size]))
    least = _PLACES_OF_DISTANCE * float(np.median(np.linalg.norm(each.seen[:, :3], axis=1)))
    if not _alternate(apart[first] < apart[second]):  # drift comes once
        least = max(least, 2.0 * _BESIDE * _extent(sensor[:, :3]))
    if moved < least and turned < 2.0 * _LEAST_RAD:
        return None
    angle = '' if each.size == 3 else f' and {math.degrees(turned):.2g} degrees'
    return Contradiction(
        f'{NOT_AT_REST}: {each.target!r} is at two places in {each.fixed_in}, '
        f'{moved:.2g} m{angle} apart',
        'give each target a name of its own, or publish it on a topic of its own'
        if moved > least else _CONFUSED)


def _alternate(here: Mask) -> bool:
    """Return whether observations (N,) in order of time change sides again and again."""
    return int((here[1:] != here[:-1]).sum()) >= _CHANGES


def _distances(places: Array, size: int) -> Array:
    """Return the distances (N, N) between places (N, 7), metres; a radian counts as a metre."""
    count = len(places)
    steps = between_many(np.repeat(places, count, axis=0), np.tile(places, (count, 1)))
    return np.linalg.norm(steps[:, :size], axis=1).reshape(count, count)
