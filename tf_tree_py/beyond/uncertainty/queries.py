# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Queries about the covariances of poses."""

from collections.abc import Sequence

import numpy as np
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.pose import Pose, Poses
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.observers import newest_of
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp, Stamps, StampsLike
from tf_tree_py.many_stamps import ManyStampQueries

from .covariance_history import covariances_by_edge
from .shared_errors import Piece, SharedErrors
from .uncertain import (
    covariances_at,
    EdgeErrors,
    errors_at,
    errors_on_fixed_path,
    Share,
    shares,
    Uncertain,
)


class UncertainQueries(ManyStampQueries):
    """Lookups with covariances, thread-safe."""

    @property
    def has_covariances(self) -> bool:
        """Return whether any edge has covariances."""
        return bool(covariances_by_edge(self._tree))

    def lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST, *,
                         independent: bool = False) -> tuple[Pose, Array]:
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
            an upper bound, which is appropriate for odometry.
        :return: the pose, and the covariance. ROS's ``Buffer`` returns a message.

        It raises the errors of ``lookup``.
        """
        _, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
        return Pose._make(pose), errors.total(pose[:3])

    def _lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp,
                          independent: bool) -> Uncertain:
        found, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
        return Uncertain(found, pose, errors.total(pose[:3]))

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
                      independent: bool = False) -> list[Share]:
        """
        Return the share of each edge in the covariance, the largest part of position first.

        It shows which calibration to improve. The shares are of first order: for small angles
        their sum is the covariance of ``lookup_uncertain``, which has the same parameters and
        errors.

        :return: a ``Share`` for each edge with a covariance.
        """
        _, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
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
