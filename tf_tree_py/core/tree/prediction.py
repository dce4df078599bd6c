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
Poses beyond the newest data: bounded, marked, and with a covariance that grows.

An edge goes on at its last twist; its rotation follows its gyroscope, as far as that reaches.
Nobody knows in advance how wrong that is. But the same prediction can be made from earlier
samples, and compared with the samples that followed. The covariance is that of these errors.
So there is nothing to tune, and it grows with the time ahead because the errors do.
"""

import operator
from typing import NamedTuple

import numpy as np

from .propagation import placed, Step, steps_of, total
from .tree import Tree
from .uncertain import around_of, covariances_of, inflated
from ..edges.aided import gyro_until, turn_of
from ..edges.corrected import CorrectedHistory
from ..edges.protocol import History, moves, MovingHistory
from ..edges.uncertainty import Around
from ..errors import ExtrapolationException, InvalidArgumentException
from ..geometry import se3, so3
from ..geometry.covariances import carried
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple, Twist
from ..geometry.so3 import Array
from ..stamp import format_span, from_seconds, LATEST

# The twist is the mean over this time before the newest sample.
_TWIST_OVER = from_seconds(0.1)
# At most this many earlier predictions are made; fewer than the least say nothing.
_MOST_TRIALS, _LEAST_TRIALS = 32, 3
_LATELY = from_seconds(10.0)


class Prediction(NamedTuple):
    """
    A pose that may lie beyond the data.

    :ivar pose: ``target_T_source``.
    :ivar covariance: (6, 6), with the edges' own covariances.
    :ivar stamp: the time that it is for, nanoseconds.
    :ivar beyond: how far beyond the newest data of an edge that is, nanoseconds; 0 where
        nothing was predicted.
    """

    pose: Pose
    covariance: Array
    stamp: int
    beyond: int


class Known(NamedTuple):
    """
    The edges between two frames, one of which has no data as new as a stamp.

    :ivar steps: with histories of their own, so that no lock is needed.
    :ivar around: of each edge, its covariances; None of those that are certain.
    """

    steps: list[Step]
    around: list[Around | None]


def known_beyond(tree: Tree, target: str, source: str, stamp: int) -> Known | None:
    """Return what a prediction needs; None if the data reaches the stamp."""
    if stamp == LATEST or target == source:
        return None
    newest = tree.ways.newest_path(target, source).latest_common_time()
    if newest == LATEST or stamp <= newest:
        return None
    steps = steps_of(tree.ways.branches(target, source, None))
    return Known([step._replace(history=step.history.copy()) for step in steps],
                 around_of(tree, steps, np.array([stamp])))


def checked_horizon(horizon: int) -> int:
    """
    Return how far a caller lets predictions go, nanoseconds.

    :raises InvalidArgumentException: no positive integer.
    """
    try:
        checked = operator.index(horizon)
    except TypeError:
        checked = 0
    if checked > 0:
        return checked
    raise InvalidArgumentException(
        f'Invalid argument horizon {horizon!r}: it is a positive number of nanoseconds')


def predicted(known: Known, stamp: int, horizon: int) -> Prediction:
    """Return a pose beyond the newest data of at least one edge; see ``Queries.predict``."""
    own = inflated(covariances_of(known.around, False),
                   [_pending(step.history, stamp) for step in known.steps])
    poses, covariances, beyond = [], [], 0
    for step, covariance in zip(known.steps, own, strict=True):
        ahead = _ahead(step.history, stamp, horizon)
        if ahead:
            beyond = max(beyond, ahead)
            pose, covariance = _gone_on(step, stamp, covariance)
        else:
            pose = step.history.sample(stamp)
        poses.append(np.array([pose]))
        covariances.append(covariance)
    there, errors = placed(known.steps, poses, covariances)
    x, y, z, qx, qy, qz, qw = there[0].tolist()
    return Prediction(Pose(x, y, z, qx, qy, qz, qw), total(errors, there[:, :3])[0],
                      stamp, beyond)


def _pending(history: History, stamp: int) -> Array | None:
    """Return what is still to be corrected of an edge at a stamp, or at its newest; (1, 6)."""
    if not isinstance(history, CorrectedHistory) or history.latest_stamp is None:
        return None
    stamp = min(stamp, history.latest_stamp)
    return history.pending(np.array([stamp]), np.array([history.sample(stamp)]))


def _ahead(history: History, stamp: int, horizon: int) -> int:
    """
    Return how far a stamp is beyond an edge's newest sample, nanoseconds; 0 if it is not.

    :raises ExtrapolationException: further than the horizon, or there is no sample at all.
    """
    if not moves(history):
        return 0
    latest = history.latest_stamp
    if latest is not None and stamp <= latest:
        return 0
    if latest is None or stamp - latest > horizon:
        error = history.extrapolation(stamp)
        error.hint = (f'A prediction goes no further than its horizon, {format_span(horizon)}: '
                      'ask for less, or find out why the edge fell silent')
        raise error
    return stamp - latest


def _gone_on(step: Step, stamp: int, covariance: Array | None) -> tuple[PoseTuple, Array]:
    """Return where an edge goes until a stamp, and how far that may be off."""
    history = step.history
    assert moves(history) and history.latest_stamp is not None
    latest = history.latest_stamp
    pose = _forecast(history, latest, stamp)
    turn = np.array(so3.as_matrix(pose[3:]))
    grown = carried(turn, np.zeros(3), _trial_errors(history, stamp - latest))
    if covariance is not None:
        # The error of the newest pose is carried on with it.
        lever = np.subtract(pose[:3], history.sample(latest)[:3])
        grown += carried(np.eye(3), lever, covariance[0])
    return pose, grown[None]


def _forecast(history: MovingHistory, begin: int, end: int) -> PoseTuple:
    """Return the pose at a stamp, out of what was known at an earlier one."""
    return se3.compose(history.sample(begin), _motion(history, begin, end))


def _motion(history: MovingHistory, begin: int, end: int) -> PoseTuple:
    """Return how an edge moves between two stamps if it keeps the velocity it had at the first."""
    twist = _twist(history, begin)
    known = gyro_until(history)
    until = begin if known is None else max(begin, min(end, known))
    turn, half = (turn_of(history, begin, stamp) for stamp in (until, (begin + until) // 2))
    if turn is None or half is None:
        return se3.exp(_times(twist, end - begin))
    # The velocity stays the same in the child's axes, which turn: Simpson's rule.
    way = _times(twist, until - begin)[:3]
    first, middle, last = way, so3.rotate(half, way), so3.rotate(turn, way)
    x, y, z = ((a + 4.0 * b + c) / 6.0 for a, b, c in zip(first, middle, last, strict=True))
    return se3.compose((x, y, z, *turn), se3.exp(_times(twist, end - until)))


def _twist(history: MovingHistory, stamp: int) -> Twist:
    """
    Return the mean twist just before a stamp, per nanosecond, in the child's axes.

    :raises ExtrapolationException: there is only one sample.
    """
    assert history.oldest_stamp is not None
    length = min(_TWIST_OVER, stamp - history.oldest_stamp)
    if length <= 0 or history.parent_at(stamp - length) != history.parent:
        raise ExtrapolationException(
            f'A prediction takes two samples, and the edge {history.parent} -> {history.child} '
            'has one under this parent')
    before, now = history.sample(stamp - length), history.sample(stamp)
    return _times(se3.log(se3.compose(se3.inverse(before), now)), 1.0 / length)


def _times(twist: Twist, factor: float) -> Twist:
    vx, vy, vz, wx, wy, wz = (factor * value for value in twist)
    return (vx, vy, vz, wx, wy, wz)


# --- how wrong it would have been

def _trial_errors(history: MovingHistory, ahead: int) -> Array:
    """
    Return the second moment (6, 6) of the errors of earlier predictions, in the child's axes.

    If there are too few of them, the error is taken to be as large as the predicted motion,
    for the edge may as well have stopped.
    """
    assert history.latest_stamp is not None
    errors = [_trial(history, begin, begin + ahead) for begin in _trial_stamps(history, ahead)]
    if len(errors) < _LEAST_TRIALS:
        latest = history.latest_stamp
        errors = [se3.log(_motion(history, latest, latest + ahead))]
    rows = np.array(errors)
    return np.asarray(rows.T @ rows / len(rows))


def _trial_stamps(history: MovingHistory, ahead: int) -> list[int]:
    """Return stamps of samples to predict from, evenly over the last 10 s."""
    oldest, latest = history.oldest_stamp, history.latest_stamp
    assert oldest is not None and latest is not None
    oldest = max(oldest, latest - _LATELY)
    knots = np.unique(history.track(oldest, latest).knots)
    knots = knots[(knots - oldest >= _TWIST_OVER) & (latest - knots >= ahead)]
    places = np.linspace(0, len(knots) - 1, min(len(knots), _MOST_TRIALS)).astype(int)
    return [stamp for stamp in knots[places].tolist()
            if all(history.parent_at(when) == history.parent
                   for when in (stamp - _TWIST_OVER, stamp, stamp + ahead))]


def _trial(history: MovingHistory, begin: int, end: int) -> tuple[float, ...]:
    """Return the error of a prediction: metres and radians, in the axes of the predicted pose."""
    predicted = _forecast(history, begin, end)
    x, y, z, qx, qy, qz, qw = se3.compose(se3.inverse(predicted), history.sample(end))
    return (x, y, z, *so3.log((qx, qy, qz, qw)))
