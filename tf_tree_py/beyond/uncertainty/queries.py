# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Queries about the covariances of poses, also of poses that share edges.

The error of an edge at a stamp is a sum of roots, each multiplied by its own unit error: the
roots of the covariance before, of the covariance after, and of the pending correction. An edge
that occurs twice has the same unit errors twice, so its common errors cancel.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, SupportsIndex

import numpy as np
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.pose import Pose, Poses
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.observers import newest_of
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp, Stamps, StampsLike
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.queries import FramesInErrors
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.many_stamps import ManyStampQueries

from .covariance_history import covariances_by_edge, known_covariances, Uncertainty
from .covariances import ends_turned, root_of, rows_of, SKEW, unpack
from .noise import add_noise, EdgeNoise, required_noise
from .propagation import SMALL_ANGLES, steps_between, with_shared_errors
from .uncertain import (
    covariances_at,
    EdgeErrors,
    errors_at,
    errors_on_fixed_path,
    pending_error,
    Share,
    shares,
    Uncertain,
)

# The child and the parent of an edge.
_Edge = tuple[str, str]
# An edge, and the stamp of its covariance; None for the pending correction.
_Cause = tuple[_Edge, int | None]
# An edge, and the stamp of its lookup.
_Asked = tuple[_Edge, int]


class Piece(NamedTuple):
    """A part of the path from a target to a source, at one stamp; ``LATEST`` if static."""

    target: str
    source: str
    stamp: int


class _Placed(NamedTuple):
    """An uncertain edge on a path, expressed in the target of the path."""

    asked: _Asked
    upwards: bool
    axes: Array
    place: Array


class _Way(NamedTuple):
    edges: list[_Placed]
    point: Array


class SharedErrors:
    """
    The errors of several poses: one path is added for each, then the joint covariance computed.

    :param tree: locked while paths are added.
    :param independent: see ``Queries.lookup_uncertain``. If an edge's errors at two of its stamps
        may be correlated in any way, the result is a bound: with weights w that add up to 1,
        the second moment of a sum of errors is at most the sum of their second moments, each
        divided by its w. The weights are those of the interpolation, averaged over the stamps.
    """

    def __init__(self, tree: Tree, independent: bool) -> None:
        self._tree = tree
        self._independent = independent
        self._ways: list[_Way] = []
        # The weight in the interpolation and the root (6, r) of each cause.
        self._errors: dict[_Asked, dict[_Cause, tuple[float, Array]]] = {}

    def add_way(self, pieces: Iterable[Piece]) -> None:
        """Add the path from a target to a source, piece by piece."""
        here: PoseTuple = se3.IDENTITY
        edges: list[_Placed] = []
        for piece in pieces:
            for step in self._steps(piece):
                pose = step.history.sample(piece.stamp)
                before, here = here, se3.compose(
                    here, se3.inverse(pose) if step.upwards else pose)
                asked = self._noted(step, piece.stamp, pose)
                if asked is not None:
                    parent, child = (here, before) if step.upwards else (before, here)
                    edges.append(_Placed(asked, step.upwards, np.array(
                        so3.as_matrix(parent[3:])), np.array(child[:3])))
        self._ways.append(_Way(edges, np.array(here[:3])))

    def _steps(self, piece: Piece) -> list[Step]:
        if piece.target == piece.source:
            return []
        return steps_between(self._tree, piece.target, piece.source,
                             None if piece.stamp == LATEST else piece.stamp)

    def _noted(self, step: Step, stamp: int, pose: PoseTuple) -> _Asked | None:
        """Store the error of an edge at a stamp; return its key, None if it is certain."""
        edge = step.history.child, step.parent
        asked = edge, stamp
        if asked in self._errors:
            return asked
        known = known_covariances(self._tree, step.parent, step.history.child)
        errors: dict[_Cause, tuple[float, Array]] = {}
        if known is not None:
            errors.update(_interpolated(known, edge, stamp, step))
        pending = pending_error(step.history, stamp, pose)
        if pending is not None:
            errors[edge, None] = 1.0, pending[:, None]
        if not errors:
            return None
        self._errors[asked] = errors
        return asked

    def covariance(self) -> Array:
        """Return the joint covariance of the n poses in the order of their paths, (6 n, 6 n)."""
        roots = self._roots()
        if not roots:
            return np.zeros((6 * len(self._ways), 6 * len(self._ways)))
        ways = [_as_target_sees(way, roots) for way in self._ways]
        moved = np.concatenate([_moved(*way) for way in ways])
        covariance = np.asarray(moved @ moved.T)
        angles = max((float((each**2)[:, 3:].sum()) for _, each, _, _ in ways), default=0.0)
        return covariance if angles <= SMALL_ANGLES else with_shared_errors(ways)

    def _roots(self) -> dict[_Asked, Array]:
        """Return the roots (6, D) of each error, for all D unit errors at once."""
        weights = {} if self._independent else self._mean_weights()
        columns: dict[_Cause, slice] = {}
        count = 0
        for cause, (_, root) in self._each():
            if cause not in columns:
                columns[cause] = slice(count, count + root.shape[1])
                count += root.shape[1]
        roots = {asked: np.zeros((6, count)) for asked in self._errors}
        for asked, errors in self._errors.items():
            for cause, (weight, root) in errors.items():
                share = weights.get(cause, 1.0)
                roots[asked][:, columns[cause]] = weight / np.sqrt(share) * root
        return roots

    def _each(self) -> Iterable[tuple[_Cause, tuple[float, Array]]]:
        return (each for errors in self._errors.values() for each in errors.items())

    def _mean_weights(self) -> dict[_Cause, float]:
        """Return the mean weight of each covariance of an edge over its stamps."""
        stamps: dict[_Edge, int] = {}
        weights: dict[_Cause, float] = {}
        for (edge, _), errors in self._errors.items():
            stamps[edge] = stamps.get(edge, 0) + 1
            for cause, (weight, _) in errors.items():
                weights[cause] = weights.get(cause, 0.0) + weight
        return {cause: weight / stamps[cause[0]] for cause, weight in weights.items()
                if cause[1] is not None}


def _interpolated(known: Uncertainty, edge: _Edge, stamp: int,
                  step: Step) -> dict[_Cause, tuple[float, Array]]:
    """Return the errors of the two covariances around a stamp, or of the one valid there."""
    first, last = known.knots_around(stamp, step.history)
    around = known.around_poses(np.array([stamp]), step.history)
    ratio = float(around.ratio[0])
    back = None if around.back is None else rows_of(around.back.reshape(-1, 9))
    turns: Array = np.array(ends_turned(around.ratio, rows_of(around.turn), back)).reshape(2, 3, 3)
    both = ((first, 1.0 - ratio, unpack(around.before[0]), turns[0]),
            (last, ratio, unpack(around.after[0]), turns[1]))
    errors: dict[_Cause, tuple[float, Array]] = {}
    for knot, weight, covariance, turn in both:
        if weight > 0.0:
            root = root_of(covariance)
            root[3:] = (turn if ratio else np.eye(3)) @ root[3:]
            errors[edge, knot] = weight, root
    return errors


def _as_target_sees(way: _Way, roots: dict[_Asked, Array],
                    ) -> tuple[Array, Array, list[bool], Array]:
    """Return places (E, 3), roots (E, 6, D) in the target's axes, directions and the point."""
    count = next(iter(roots.values())).shape[1]
    turned = np.zeros((len(way.edges), 6, count))
    for number, edge in enumerate(way.edges):
        root = roots[edge.asked]
        turned[number] = np.concatenate([edge.axes @ root[:3], edge.axes @ root[3:]])
    places = np.array([edge.place for edge in way.edges]).reshape(-1, 3)
    return places, turned, [edge.upwards for edge in way.edges], way.point


def _moved(places: Array, roots: Array, upwards: Sequence[bool], point: Array) -> Array:
    """Return how unit errors move a point, (6, D), to first order."""
    signs = np.where(upwards, -1.0, 1.0)[:, None, None]
    crossed = ((point - places) @ SKEW).reshape(-1, 3, 3)
    shifts = roots[:, :3] - crossed @ roots[:, 3:]
    return np.concatenate([(signs * part).sum(axis=0) for part in (shifts, roots[:, 3:])])


# --- queries

class UncertainQueries(ManyStampQueries):
    """Lookups with covariances, thread-safe."""

    @property
    def has_covariances(self) -> bool:
        """Return whether any edge has covariances."""
        return bool(covariances_by_edge(self._tree))

    def lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST, *,
                         independent: bool = False,
                         learnt_noise: bool = False) -> tuple[Pose, Array]:
        """
        Return ``target_T_source`` and its covariance.

        The covariance is (6, 6) of x, y, z and rotation about x, y, z, in metres^2 and
        radians^2, as in ``PoseWithCovariance``, with the target as the parent: t' = t + dt in
        the target's axes, R' = Exp(dr) R about the target's fixed axes through the source's
        origin. The edges' errors are independent of each other; edges without a covariance
        are certain. It is the second moment about the pose. Rotations are limited to half a
        turn, so an unknown yaw, given with a variance such as 1e6, results in about
        pi^2 / 3 radians^2.

        :param stamp: nanoseconds, or ``LATEST``.
        :param independent: whether one edge's errors at two of its stamps are independent.
            If not, they may be correlated in any way, and the result between two stamps is
            an upper bound of first order, which is appropriate for odometry.
        :param learnt_noise: whether moving edges without a covariance have the noise that
            ``edge_noise`` returns. Without it they are certain.
        :return: the pose, and the covariance. ROS's ``Buffer`` returns a message.

        It raises the errors of ``lookup``; with ``learnt_noise`` also those of ``edge_noise``.
        """
        found = self._lookup_uncertain(
            target_frame, source_frame, stamp, independent, learnt_noise)
        return Pose._make(found.pose), found.covariance

    def edge_noise(self, child: str) -> EdgeNoise:
        """
        Return the noise of the samples of a moving edge, learnt from those of the last 10 s.

        It is the part of their errors that is independent from sample to sample: what the motion,
        which is smooth, does not explain. Errors that last for several samples, such as the drift
        of an odometry or those of a filter, are not in it. A motion that changes from sample to
        sample is, because nothing distinguishes it from noise.

        :param child: the child frame of the edge.
        :return: the covariance, in the axes of the child, and how many residuals it rests on.
        :raises LookupException: the frame is unknown.
        :raises InvalidArgumentException: it has no parent, or its edge is static.
        :raises ExtrapolationException: there are too few samples.
        """
        child = child.removeprefix('/')
        with self._lock:
            self._tree.paths.check_frame('child', child, 'edge_noise')
            history = self._tree.histories.get(child)
            parent = None if history is None else history.parent
            if history is None or parent is None or not moves(history):
                why = 'has no parent' if parent is None else 'is static'
                raise InvalidArgumentException(
                    f'Invalid argument child "{child}": its edge has no samples whose noise could '
                    f'be learnt, because it {why}')
            return required_noise(self._tree, history, parent)

    def _lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp,
                          independent: bool, learnt_noise: bool = False,
                          *limit: SupportsIndex | None) -> Uncertain:
        """Return ``lookup_uncertain``; a limit is an argument of an overriding ``_errors_at``."""
        found, pose, errors = self._errors_with_noise(
            target_frame, source_frame, stamp, independent, learnt_noise, *limit)
        return Uncertain(found, pose, errors.total(pose[:3]))

    def _errors_with_noise(self, target_frame: str, source_frame: str, stamp: Stamp,
                           independent: bool, learnt_noise: bool,
                           *limit: SupportsIndex | None) -> tuple[int, PoseTuple, EdgeErrors]:
        if not learnt_noise:
            return self._errors_at(target_frame, source_frame, stamp, independent, *limit)
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            found, pose, errors = self._errors_at(
                target_frame, source_frame, stamp, independent, *limit)
            add_noise(self._tree, errors, target_frame, source_frame, found,
                      self._stamp_of(stamp) == LATEST)
        return found, pose, errors

    def _errors_at(self, target_frame: str, source_frame: str, stamp: Stamp,
                   independent: bool) -> tuple[int, PoseTuple, EdgeErrors]:
        if type(stamp) is not int:
            stamp = self._stamp_of(stamp)
        with self._lock:
            known = None if self.observers.of_lookups else errors_on_fixed_path(
                self._tree, target_frame, source_frame, stamp, independent)
            if known is not None:
                return known
            found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
            return found, pose, errors_at(self._tree, target_frame, source_frame, found,
                                          stamp == LATEST, independent)

    def lookup_budget(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST, *,
                      independent: bool = False, learnt_noise: bool = False) -> list[Share]:
        """
        Return the share of each edge in the covariance, the largest part of position first.

        It shows which calibration to improve. The shares are of first order: for small angles
        their sum is the covariance of ``lookup_uncertain``, which has the same parameters and
        errors.

        :return: a ``Share`` for each edge with a covariance, or with ``learnt_noise`` each that
            moves, too.
        """
        _, pose, errors = self._errors_with_noise(
            target_frame, source_frame, stamp, independent, learnt_noise)
        return shares(errors, pose)

    def lookup_uncertain_many(self, target_frame: str, source_frame: str,
                              stamps: StampsLike, *,
                              independent: bool = False) -> tuple[Poses, Array]:
        """
        Return poses and covariances at many stamps, as one ``lookup_uncertain`` for each would.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is an ordinary stamp.
        :return: (N, 7) and (N, 6, 6).

        It raises the errors of ``lookup_many``.
        """
        times = self._stamps_of(stamps)
        return self.observers.watch(
            newest_of(target_frame, source_frame, times),
            self._lookup_uncertain_many, target_frame, source_frame, times, independent)

    def _lookup_uncertain_many(self, target_frame: str, source_frame: str, times: Stamps,
                               independent: bool) -> tuple[Poses, Array]:
        still = self.snapshot()
        poses = still.lookup_many(target_frame, source_frame, times)
        return poses, covariances_at(
            still._tree, target_frame, source_frame, times, np.asarray(poses), independent)

    def lookup_uncertain_full(self, target_frame: str, target_stamp: Stamp,
                              source_frame: str, source_stamp: Stamp, fixed_frame: str, *,
                              independent: bool = False) -> tuple[Pose, Array]:
        """
        Return the pose of ``lookup_full`` and its covariance (6, 6), as in ``lookup_uncertain``.

        Errors that both times have in common cancel: those of an edge above both frames, if
        nothing moves between it and the fixed frame; and those of a sensor's mounting, as long
        as the robot has not rotated. A covariance that is valid at both stamps, of a static
        edge or an edge with only one covariance, is one error. If a moving edge has different
        covariances at the two stamps, their correlation is unknown: the result is an upper
        bound, up to twice the sum of both, or the sum of both with ``independent``.

        The other parameters and errors are those of ``lookup_full`` and ``lookup_uncertain``.
        """
        found = self._lookup_uncertain_full(
            target_frame, target_stamp, source_frame, source_stamp, fixed_frame, independent)
        return Pose._make(found.pose), found.covariance

    def _lookup_uncertain_full(self, target_frame: str, target_stamp: Stamp,
                               source_frame: str, source_stamp: Stamp, fixed_frame: str,
                               independent: bool) -> Uncertain:
        errors = SharedErrors(self._tree, independent)
        with self._lock:
            found, pose = self.lookup_full_stamped(
                target_frame, target_stamp, source_frame, source_stamp, fixed_frame)
            source_stamp = self._stamp_of(source_stamp)
            if source_stamp == LATEST:
                source_stamp = self.latest_common_time(fixed_frame, source_frame)
            errors.add_way([Piece(target_frame, fixed_frame, found),
                            Piece(fixed_frame, source_frame, source_stamp)])
        return Uncertain(found, pose, errors.covariance())

    def lookup_joint(self, target_frame: str, source_frames: Sequence[str],
                     stamp: Stamp = LATEST, *, independent: bool = False) -> tuple[Poses, Array]:
        """
        Return the poses of n frames in the target at one stamp, and their joint covariance.

        Frames that share uncertain edges have correlated errors: the off-diagonal blocks are
        the covariances of one pose's errors with another's. The diagonal blocks are those of
        ``lookup_uncertain``; for large angles they differ by the spread of the draws.

        :param source_frames: n frames, such as those of all cameras of a robot.
        :param stamp: nanoseconds; ``LATEST`` is the newest time for which the edges to all
            frames have data.
        :param independent: see ``lookup_uncertain``.
        :return: (n, 7), and (6 n, 6 n), a block of six for each frame, in their order.
        :raises InvalidArgumentException: one name instead of several.

        The other errors are those of ``lookup``.
        """
        if isinstance(source_frames, str):
            raise InvalidArgumentException(
                f'source_frames must be a list of frames, not one name, {source_frames!r}')
        stamp, errors = self._stamp_of(stamp), SharedErrors(self._tree, independent)
        with self._lock:
            if stamp == LATEST:
                stamp = self._newest_of(target_frame, source_frames)
            poses = [self.lookup_stamped(target_frame, source, stamp)[1]
                     for source in source_frames]
            for source in source_frames:
                errors.add_way([Piece(target_frame, source, stamp)])
        return Poses(np.array(poses).reshape(-1, 7)), errors.covariance()

    def _newest_of(self, target_frame: str, source_frames: Sequence[str]) -> int:
        """Return the newest time common to all edges to some frames; ``LATEST`` if static."""
        times = [self.latest_common_time(target_frame, source)
                 for source in source_frames if source != target_frame]
        return min((time for time in times if time != LATEST), default=LATEST)
