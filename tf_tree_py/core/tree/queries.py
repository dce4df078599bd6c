# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
All queries of a tree: one pose, many poses, their covariances, and the contents.

The buffer, whose tree changes, and a snapshot, whose tree does not, share them.
"""

from collections.abc import Sequence
from functools import partial
import importlib
import os
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from .corrections import correction_of, smoothed
from .edge_samples import samples_around, stamps_of, twists_between
from .frozen import freeze, Frozen, read_tree, thaw, write_frozen
from .lookups import Lookups, Naming
from .many_stamps import poses_at, refuse_missing, warn_of_units
from .outline import as_html, EdgeInfo, info_of, summary
from .prediction import checked_horizon, predicted, Prediction
from .shared_errors import Piece, SharedErrors
from .source_samples import EdgeSource
from .uncertain import covariances_at, Share, shares, Uncertain
from .uncertain_lookup import EdgeErrors, errors_at, errors_on_fixed_path
from .. import fork_locks
from ..errors import InvalidArgumentException
from ..geometry.framed_pose import FramedPose, Source, Target
from ..geometry.many_poses import Poses
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..ingest.observers import asked
from ..stamp import LATEST
from ..times import Stamp, Stamps, StampsLike, without_mask


class Queries(Lookups):
    """All queries of a tree, thread-safe; see ``Lookups`` about stamps."""

    # --- one pose, with its names

    def lookup_framed(self, target_frame: Target, source_frame: Source,
                      stamp: Stamp = LATEST) -> FramedPose[Target, Source]:
        """
        Return the pose of ``lookup`` with its frames and its stamp.

        ``a @ b`` composes such poses only if their inner frame names are equal.
        """
        found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
        return FramedPose(target_frame, source_frame, Pose._make(pose), found)

    # --- many poses

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['raise'] = 'raise') -> Poses: ...

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['mask']) -> tuple[Poses, npt.NDArray[np.bool_]]: ...

    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: str = 'raise') -> Any:
        """
        Return ``target_T_source`` at many stamps, as one ``lookup`` for each would.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is an ordinary stamp. Masked
            stamps have no answer.
        :param outside: how to treat stamps without an answer: 'raise' an error, or 'mask':
            return NaN for them, and which stamps are valid.
        :return: (N, 7) poses x y z qx qy qz qw, an array with ``@``, ``.inverse()``,
            ``.translation``, ``.rotation`` and ``.as_matrix()``; with 'mask' also (N,)
            booleans.
        :raises InvalidArgumentException: stamps that are not integers, or not of shape (N,).
        :raises TransformException: as in ``lookup``; with 'mask' only if a frame is unknown,
            or the two were never connected.

        The numbers equal those of ``lookup`` to 1e-12 (metres, and components of quaternions);
        for edges longer than 100 metres, to 1e-14 of their length.
        """
        stamps, given = without_mask(stamps)
        array = self._stamps_of(stamps)
        if outside not in ('raise', 'mask'):
            raise InvalidArgumentException(f"outside must be 'raise' or 'mask', not {outside!r}")
        if len(array) and self.observers.hear_lookups():
            return self.observers.watch(
                [(target_frame, source_frame, int(array.max()))],
                self._lookup_many, target_frame, source_frame, array, given, outside)
        return self._lookup_many(target_frame, source_frame, array, given, outside)

    def _lookup_many(self, target_frame: str, source_frame: str, array: Stamps,
                     given: npt.NDArray[np.bool_] | None, outside: str) -> Any:
        with Naming(target_frame, source_frame):
            poses, valid = poses_at(self._tree, self._lock, target_frame, source_frame, array)
        if given is not None:
            valid &= given
            poses[~given] = np.nan
        if outside == 'mask':
            if len(array) and not valid.any():
                warn_of_units(partial(self.lookup_at, target_frame, source_frame), array)
            return Poses(poses), valid
        refuse_missing(partial(self.lookup_at, target_frame, source_frame), array, given, valid)
        return Poses(poses)

    def lookup_tree(self, target_frame: str, stamp: Stamp = LATEST) -> dict[str, Pose]:
        """
        Return ``target_T_frame`` for every frame that can be expressed in the target.

        This is one pass over the tree. A frame is omitted if it has another root, or if an
        edge between it and the target has no data for the stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time for which every moving edge
            of this tree has data.
        :raises LookupException: the target is unknown.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer.
        """
        stamp = self._stamp_of(stamp)
        with self._lock, Naming(target_frame, None):
            if stamp == LATEST:
                stamp = self._tree.spanning.newest_of_all(target_frame)
            poses = self._tree.spanning.poses_from(target_frame, stamp)
        return {frame: Pose._make(pose) for frame, pose in poses.items()}

    def _twists_between(self, near: str, far: str, stamps: Stamps) -> Array | None:
        with self._lock:
            return twists_between(self._tree, near, far, stamps)

    # --- covariances

    @property
    def has_covariances(self) -> bool:
        """Return whether any edge has covariances."""
        return bool(self._tree.uncertainty)

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
        found = self._lookup_uncertain(target_frame, source_frame, stamp, independent)
        return Pose._make(found.pose), found.covariance

    def _lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp,
                          independent: bool) -> Uncertain:
        found, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
        return Uncertain(found, pose, errors.total(pose[:3]))

    def _errors_at(self, target_frame: str, source_frame: str, stamp: Stamp,
                   independent: bool) -> tuple[int, PoseTuple, EdgeErrors]:
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
        if len(times) and self.observers.hear_lookups():
            return self.observers.watch(
                [(target_frame, source_frame, int(times.max()))], lambda: (
                    self.lookup_uncertain_many(target_frame, source_frame, times,
                                               independent=independent)))
        frozen = self.snapshot()
        poses = frozen.lookup_many(target_frame, source_frame, times)
        return poses, covariances_at(
            frozen._tree, target_frame, source_frame, times, poses, independent)

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

    def predict(self, target_frame: str, source_frame: str, stamp: Stamp,
                horizon: int) -> Prediction:
        """
        Return ``target_T_source`` at a stamp that may be beyond the newest data.

        Each edge that does not reach the stamp continues at the mean twist of its last 0.1 s,
        and rotates as its gyroscope measured, if it is aided. The covariance has two parts:
        the errors of the same prediction made from earlier samples, and the edges' own
        covariances. It cannot anticipate braking that never occurred before. If all data
        reaches the stamp, the pose is looked up.

        :param stamp: nanoseconds; ``LATEST`` predicts nothing.
        :param horizon: nanoseconds; no edge is predicted further beyond its newest sample.
        :return: the pose, the covariance (6, 6), and how far ``beyond`` the data the pose is.
        :raises FutureExtrapolationException: an edge ends further away than the horizon.

        The other errors are those of ``lookup``.
        """
        stamp, horizon = self._stamp_of(stamp), checked_horizon(horizon)
        if self.observers.hear_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.predict, target_frame, source_frame, stamp, horizon)
        with Naming(target_frame, source_frame):
            with self._lock:
                ahead = predicted(self._tree, target_frame, source_frame, stamp, horizon)
            if ahead is not None:
                return ahead
            found = self._lookup_uncertain(target_frame, source_frame, stamp, False)
        return Prediction(Pose._make(found.pose), found.covariance, found.stamp, 0)

    # --- corrections

    @property
    def corrections_version(self) -> int:
        """Return the number of corrections and switches so far; it never decreases."""
        return self._tree.corrections

    def correction_of(self, child: str) -> Pose:
        """
        Return the newest correction of an edge, even while it is in transition to it.

        After the transition, ``parent_T_child`` is this correction times the inserted pose.
        Without corrections it is the identity.
        """
        with self._lock:
            return correction_of(self._tree, child)

    # --- contents

    def smoothed(self) -> 'Snapshot':
        """
        Return a snapshot with all corrections applied to the past, too.

        The live tree is inaccurate during a blend, which avoids jumps, and its past is never
        corrected. In this snapshot every sample has the correction for its own stamp, which is
        interpolated between two corrections. An edge that changed its source has the samples
        of its present source from their beginning. It is meant for maps and post-processing.
        """
        with self._lock:
            return Snapshot(smoothed(self._tree))

    def sources_of(self, child: str) -> list[EdgeSource]:
        """Return the sources of an edge, in order of their first samples."""
        with self._lock:
            sources = self._tree.sources.get(child)
            return sources.listed() if sources else []

    def snapshot(self) -> 'Snapshot':
        """
        Return a copy of the present state, for several lookups that must be consistent.

        It copies the samples, which takes about 20 us for each moving edge with 1,000 samples.
        """
        with self._lock:
            return Snapshot(self._tree.copy())

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write the present state to a file, which ``load`` opens at once.

        Covariances, curves and gyroscopes are included.

        :param path: such as ``run.tftree``; an existing file is replaced atomically.
        :raises TreeFileError: the file cannot be written, or a curve is of a kind that files do
            not support: see ``Curve``.
        """
        write_frozen(self._frozen(checksum=True), path)

    def record(self, path: str | os.PathLike[str]) -> None:
        """
        Write all present poses to a bag, which ``ros2 bag play`` and viewers open.

        This needs rosbags (``pip install rosbags``). ``open_bag`` restores the same buffer,
        except for data that a bag cannot contain: a spline becomes poses, ten for each of its
        pieces; any other curve becomes 100 poses per second, 100,000 at most; covariances and
        the samples of gyroscopes are omitted.

        :param path: of a file, such as ``incident.mcap``; without that suffix, of a folder.
        :raises TreeFileError: the path exists already, or cannot be written.
        """
        with self._lock:
            still = self._tree.copy()
        # The layer for bags is above this one, so a normal import of it is not allowed here.
        importlib.import_module('tf_tree_py.bag.recorder').record(still, path)

    def _frozen(self, *, checksum: bool = False) -> Frozen:
        with self._lock:
            still = self._tree.copy()
        return freeze(still, checksum=checksum)

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge with data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [info_of(history.parent, history)
                    for history in histories if history.parent is not None]

    def parents_at(self, stamp: Stamp) -> dict[str, str]:
        """
        Return the parent of each frame at a stamp; frames without data for it have none.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        stamp = self._stamp_of(stamp)
        with self._lock:
            parents = {child: history.parent_at(stamp)
                       for child, history in self._tree.histories.items()}
        return {child: parent for child, parent in parents.items() if parent is not None}

    def stamps_of(self, frame: str) -> Stamps:
        """
        Return the stamps of the samples of a frame's edge to its parent.

        :return: (N,) nanoseconds, sorted; none for a static edge or a root.
        """
        with self._lock:
            return stamps_of(self._tree.histories.get(frame))

    def samples_around(self, child_frame: str, stamp: Stamp) -> list[tuple[int, Pose]]:
        """
        Return the samples of a frame's edge at or next to a stamp, with their own stamps.

        There is one sample if it has exactly this stamp, or if the stamp is outside the stored
        span; there are two between two samples, and none for a static or unknown edge.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        with self._lock:
            return samples_around(self._tree.histories.get(child_frame), self._stamp_of(stamp))

    def __repr__(self) -> str:
        return f'<{self._summary()}>'

    def _repr_html_(self) -> str:
        """Return the tree as HTML for a notebook."""
        return as_html(self._summary(), Queries.edges(self))

    def _summary(self) -> str:
        # ROS's Buffer overrides edges(), and may query the graph for the publishers there.
        return f'{type(self).__name__}: {summary(len(self.frames()), Queries.edges(self))}'


class Snapshot(Queries):
    """
    A buffer's contents at one moment, which never change.

    It supports all queries of a buffer. All its results are consistent with each other,
    regardless of new data in the buffer. It can be pickled, to store it in a file or to send
    it to another process.
    """

    def snapshot(self) -> 'Snapshot':
        """Return this snapshot, because it never changes."""
        return self

    def _frozen(self, *, checksum: bool = False) -> Frozen:
        with self._lock:  # protects the caches of histories; the samples never change
            return freeze(self._tree, checksum=checksum)

    def __getstate__(self) -> dict[str, Any]:
        state = {**self.__dict__, '_tree': self._frozen().as_bytes()}
        del state['_lock']
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _tree=thaw(state['_tree']))
        self._lock = fork_locks.rlock()


def load(path: str | os.PathLike[str], *, verify: bool = False) -> Snapshot:
    """
    Open a file that ``save`` of a buffer wrote; lookups give the same results as the buffer.

    Opening takes a few milliseconds, regardless of the size; lookups read the data from the
    file when they need it, so the file must not be removed.

    :param verify: whether to read the whole file first, and compare it with the checksum that
        ``save`` wrote. Without it, a changed bit in a sample gives a wrong number. The checksum
        detects accidental changes only; a deliberate change can include the checksum.
    :raises TreeFileError: the file cannot be read, is not a frozen tree, or is incomplete; or,
        with ``verify``, it has changed since it was written, or has no checksum.
    """
    return Snapshot(read_tree(path, verify=verify))
