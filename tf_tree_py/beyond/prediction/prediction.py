# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses beyond the newest data, bounded and marked, with a covariance that grows.

An edge continues at its last twist; its rotation follows its gyroscope as long as there is
data. The error of a prediction is unknown in advance. But the same prediction can be made from
earlier samples, and compared with the samples that followed (``trials``). And the edge may stop
at any time (``past``). So there is nothing to tune.
"""

from collections.abc import Mapping
import operator
from typing import NamedTuple

from tf_tree_py.core.edges.protocol import History, moves, MovingHistory
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages import observers
from tf_tree_py.core.stamp import BEGINNING, format_span, LATEST
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.queries import FramesInErrors
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.screws import Twist

from .commanded import Commands
from .forecast import (
    Asked,
    AT_REST,
    forecast,
    measured_until,
    Start,
    start_at,
    start_with,
)
from .past import (
    ByChild,
    checked_limits,
    checked_twists,
    errors,
    errors_with_command,
    Limits,
    to_stop,
)
from .trials import Trials
from ..curves.aided import gyro_until
from ..uncertainty.covariance_history import known_covariances
from ..uncertainty.covariances import packed_term, Terms
from ..uncertainty.learning import Learnt, Span
from ..uncertainty.noise import add_noise, add_noise_of, EdgeNoise, SampleNoise
from ..uncertainty.propagation import steps_between
from ..uncertainty.queries import UncertainQueries
from ..uncertainty.uncertain import EdgeErrors, terms_of


class Prediction(NamedTuple):
    """
    A pose that may be beyond the newest data.

    :ivar pose: ``target_T_source``.
    :ivar covariance: (6, 6), including the edges' own covariances.
    :ivar stamp: the time of the pose, nanoseconds.
    :ivar beyond: how far that is beyond the newest data of an edge, nanoseconds; 0 if nothing
        was predicted.
    """

    pose: Pose
    covariance: Array
    stamp: int
    beyond: int


def _checked_horizon(horizon: int) -> int:
    """
    Return the largest time ahead that a caller allows, nanoseconds.

    :raises InvalidArgumentException: not a positive integer.
    """
    try:
        checked = operator.index(horizon)
    except TypeError:
        checked = 0
    if checked > 0:
        return checked
    raise InvalidArgumentException(
        f'Invalid argument horizon {horizon!r}: it must be a positive number of nanoseconds')


def predicted(tree: Tree, target: str, source: str, stamp: int, horizon: int,
              limits: Mapping[str, Limits], twists: Mapping[str, Twist]) -> Prediction | None:
    """
    Return a pose beyond the newest data, as ``Queries.predict``, with the lock held.

    :param limits: of the accelerations, by child frame; ``twists``: per second, likewise.
    :return: None if all data reaches the stamp.
    """
    if stamp == LATEST or target == source:
        return None
    path = tree.paths.newest_path(target, source)
    if not path.moving or stamp <= path.latest_common_time():
        return None
    steps = path.steps() if path.fixed else steps_between(tree, target, source, None)
    return _Way(tree, stamp, horizon, limits, twists).along(steps)


class _Newest:
    """What predictions use of an edge's newest sample; see ``learning``."""

    __slots__ = ('_sample', '_known')

    def __init__(self, history: MovingHistory) -> None:
        self.forget(history, BEGINNING)

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all."""
        self._sample: tuple[int, PoseTuple] | None = None
        self._known: tuple[Span, EdgeNoise | None, Start, Limits] | None = None

    def at(self, learnt: Learnt, history: MovingHistory, stamp: int,
           may_rest: bool) -> tuple[Span, EdgeNoise | None, Start, Limits]:
        """
        Return the time that counts, the noise, the state, and how the edge would stop.

        :param stamp: of the newest sample.
        :param may_rest: whether an edge with only one sample rests.
        :raises ExtrapolationException: otherwise.
        """
        # A sample with the same stamp replaces the newest one; a gyroscope changes older poses.
        sample = stamp, history.sample(stamp)
        if self._known is None or sample != self._sample or gyro_until(history) is not None:
            span, noise = learnt.of(history, SampleNoise).at(history, stamp)
            if span.oldest >= stamp and may_rest:
                return span, noise, start_with(history, stamp, AT_REST), AT_REST
            start = start_at(history, stamp, span.oldest)
            self._sample, self._known = sample, (span, noise, start,
                                                 to_stop(history, span, start))
        return self._known


class _Way:
    """A path at a stamp for which some of its edges have no data."""

    def __init__(self, tree: Tree, stamp: int, horizon: int,
                 limits: Mapping[str, Limits], twists: Mapping[str, Twist]) -> None:
        self._tree, self._stamp, self._horizon = tree, stamp, horizon
        self._limits, self._twists = limits, twists
        self._errors = EdgeErrors()
        self._here: PoseTuple = se3.IDENTITY

    def along(self, steps: list[Step]) -> Prediction:
        """Compose the edges, and return the prediction."""
        aheads = [_ahead(step.history, self._stamp, self._horizon) for step in steps]
        for step, ahead in zip(steps, aheads, strict=True):
            if ahead and moves(step.history):
                self._predict(step, step.history, ahead)
            else:
                pose = step.history.sample(self._stamp)
                before = self._go(step, pose)
                terms = self._terms(step, self._stamp, pose)
                if terms is not None:
                    self._errors.add_edge(step, before, self._here, terms)
                add_noise_of(self._tree, self._errors, step,
                             before if step.upwards else self._here, self._stamp, False)
        total = self._errors.total(self._here[:3])
        return Prediction(Pose._make(self._here), total, self._stamp, max(aheads))

    def _go(self, step: Step, pose: PoseTuple) -> PoseTuple:
        """Append an edge; return the pose before it."""
        before = self._here
        self._here = se3.compose(before, se3.inverse(pose) if step.upwards else pose)
        return before

    def _terms(self, step: Step, stamp: int, pose: PoseTuple) -> Terms | None:
        """Return the errors of an edge with its pose at a stamp."""
        known = known_covariances(self._tree, step.parent, step.history.child)
        return terms_of(known, step.history, stamp, pose, False)

    def _predict(self, step: Step, history: MovingHistory, ahead: int) -> None:
        """Append a predicted edge, with the errors of the newest pose and of the prediction."""
        learnt = self._tree.companion_or_new(Learnt)
        twist = self._twists.get(history.child)
        span, noise, free, stop = learnt.of(history, _Newest).at(
            learnt, history, self._stamp - ahead, twist is not None)
        start = free if twist is None else start_with(history, free.stamp, twist)
        until = measured_until(history, start.stamp, self._stamp)
        pose = forecast(history, start, self._stamp, until)
        before = self._go(step, pose)
        parent, child = (self._here, before) if step.upwards else (before, self._here)
        # The error of the newest pose also affects the prediction; a covariance includes noise.
        has_own = known_covariances(self._tree, step.parent, history.child) is not None
        terms = self._terms(step, start.stamp, start.pose)
        if terms is not None:
            self._errors.add(step, parent[3:], se3.apply(parent, start.pose[:3]), terms)
        asked = Asked(span, start, stop, ahead, until, None if noise is None else noise.covariance,
                      0.0 if has_own else 1.0)
        trials = learnt.of(history, Trials)
        if twist is None:
            found = errors(trials, history, asked, self._limits.get(history.child))
        else:
            commands = self._tree.companion_or_new(Commands)
            found = errors_with_command(commands, trials, history, asked, free)
            commands.note(history.child, asked, free.twist)
        self._errors.add(step, child[3:], child[:3], packed_term(found))


def _ahead(history: History, stamp: int, horizon: int) -> int:
    """
    Return how far a stamp is beyond an edge's newest sample, nanoseconds; 0 if it is not.

    :raises ExtrapolationException: it is beyond the horizon, or there is no sample.
    """
    if not moves(history):
        return 0
    newest, latest = history.newest_stamp, history.latest_stamp
    if latest is not None and stamp <= latest:
        return 0  # it has a pose, also if the edge only holds its newest sample
    if newest is None or stamp - newest > horizon:
        error = history.extrapolation(stamp)
        error.hint = ('The stamp is beyond the horizon of the prediction, '
                      f'{format_span(horizon)}: use an earlier stamp, or find out why the edge '
                      'is silent')
        raise error
    return stamp - newest


# --- queries

class PredictionQueries(UncertainQueries):
    """Predictions, thread-safe."""

    def predict(self, target_frame: str, source_frame: str, stamp: Stamp, horizon: int, *,
                acceleration: ByChild | None = None,
                twist: ByChild | None = None) -> Prediction:
        """
        Return ``target_T_source`` at a stamp that may be beyond the newest data.

        Each edge that does not reach the stamp continues at the mean twist of its last 0.1 s,
        and rotates as its gyroscope measured, if it is aided. The covariance is that of the
        errors of such predictions from earlier samples, added to that of the newest pose: the
        edge's own, or else the noise that ``edge_noise`` returns. If all data reaches the
        stamp, the pose is looked up. A predicted edge also counts as if it might stop within
        0.5 s, or accelerate up to a given limit.

        :param stamp: nanoseconds; ``LATEST`` predicts nothing.
        :param horizon: nanoseconds; no edge is predicted further beyond its newest sample.
        :param acceleration: the largest accelerations of edges, by child frame: six numbers
            along x, y, z (m/s^2) and about x, y, z (rad/s^2), in the child's axes. Other
            edges may stop within 0.5 s.
        :param twist: the velocities that edges are known to have from their newest samples on,
            such as commanded ones, by child frame: six numbers along x, y, z (m/s) and about x, y,
            z (rad/s), in the child's axes. The covariance is then that of the errors of earlier
            predictions with a velocity. Before there are enough of them, it is the one without
            a velocity, plus the square of the difference that the velocity makes. The prediction
            itself is kept for this; one by a snapshot is not.
        :return: the pose, the covariance (6, 6), and how far ``beyond`` the data the pose is.
        :raises LookupException: a frame is unknown, also one of ``twist``.
        :raises FutureExtrapolationException: an edge ends further away than the horizon.
        :raises InvalidArgumentException: a horizon, an acceleration or a twist that is not as
            above; or both of these for one edge.

        The other errors are those of ``lookup``.
        """
        stamp, horizon = self._stamp_of(stamp), _checked_horizon(horizon)
        limits = checked_limits(acceleration)
        return self.observers.watch(
            [observers.asked(target_frame, source_frame, stamp)], self._predict, target_frame,
            source_frame, stamp, horizon, limits, checked_twists(twist, limits))

    def _predict(self, target_frame: str, source_frame: str, stamp: int, horizon: int,
                 limits: Mapping[str, Limits], twists: Mapping[str, Twist]) -> Prediction:
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            for child in twists:  # a misspelt name would be a prediction without the command
                self._tree.paths.check_frame('twist', child, 'predict')
            ahead = predicted(
                self._tree, target_frame, source_frame, stamp, horizon, limits, twists)
            if ahead is not None:
                return ahead
            found, pose, known = self._errors_at(target_frame, source_frame, stamp, False)
            add_noise(self._tree, known, target_frame, source_frame, found, stamp == LATEST, False)
        return Prediction(Pose._make(pose), known.total(pose[:3]), found, 0)
