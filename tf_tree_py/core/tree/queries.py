"""
The questions to a tree: one lookup, many stamps, all frames.

The buffer, whose tree changes, and a snapshot, whose tree does not, share them.
"""

from collections.abc import Callable
import threading
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from .corrections import CorrectionQueries
from .outline import as_html, EdgeInfo, summary
from .path import Path
from .prediction import checked_horizon, known_beyond, predicted, Prediction
from .propagation import Errors, total_at
from .tree import Tree
from .uncertain import covariances_at, gathered_at, Share, shares, Uncertain
from ..arrivals.observers import asked, halves, NOBODY, Observers
from ..edges.protocol import History
from ..errors import (
    Blocker,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)
from ..geometry import se3
from ..geometry.pose import Pose
from ..geometry.screws import carry_many
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, format_stamp, LATEST
from ..times import checked_stamp, checked_stamps, Stamps, without_mask


class Queries(CorrectionQueries):
    """
    Lookups on a tree, from any thread.

    ``lookup('map', 'camera', stamp)`` gives ``map_T_camera``: it takes coordinates
    in camera to coordinates in map, as everything was at the stamp. Stamps are
    integer nanoseconds. In ``lookup`` and other questions for one pose the stamp 0 is
    ``LATEST``, as in tf2: the newest time that every edge between the two frames has data
    for. In ``lookup_at``, and in all that takes many stamps, 0 is a time like any other,
    for data whose time begins at 0.
    """

    def __init__(self, tree: Tree) -> None:
        # Re-entrant, so that a wait can hold it across a query and its own registration.
        self._lock = threading.RLock()
        self._tree = tree

    # Nobody watches a snapshot.
    observers: Observers = NOBODY
    """Who is told of every lookup; see ``Observer``."""

    # What callers give as stamps, as integers; ``ros`` takes ROS times as well.
    _stamp_of: Callable[[Any], int] = staticmethod(checked_stamp)

    def _stamps_of(self, stamps: npt.ArrayLike) -> Stamps:
        return checked_stamps(stamps, self._stamp_of)

    @property
    def cache_time(self) -> int:
        """Return how much history each edge keeps, nanoseconds."""
        return self._tree.cache_time

    # --- one pose

    def lookup(self, target_frame: str, source_frame: str, stamp: int = LATEST) -> Pose:
        """
        Return ``target_T_source`` at a stamp.

        :param stamp: nanoseconds, or ``LATEST``.
        :raises InvalidArgumentException: a name that cannot be a frame, or a stamp that is
            no integer.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        :raises ExtrapolationException: an edge between them has no data for the stamp.
        """
        return Pose._make(self.lookup_stamped(target_frame, source_frame, stamp)[1])

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: int = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp that ``LATEST`` came to, and the pose; see ``lookup``."""
        if type(stamp) is not int:
            stamp = self._stamp_of(stamp)
        if self.observers.of_lookups and self.observers.hear_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.lookup_stamped, target_frame, source_frame, stamp)
        try:
            with self._lock:
                if target_frame == source_frame:
                    return self._own_stamp(target_frame, stamp), se3.IDENTITY
                if stamp == LATEST:
                    return self._tree.ways.newest_pose(target_frame, source_frame)
                return stamp, self._tree.ways.pose_at(target_frame, source_frame, stamp)
        except TransformException as error:
            error.target_frame, error.source_frame = target_frame, source_frame
            raise

    def lookup_at(self, target_frame: str, source_frame: str, stamp: int) -> Pose:
        """
        Return ``target_T_source`` at a stamp, where 0 is a time and not ``LATEST``.

        Otherwise as ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        if self.observers.hear_lookups():
            return self.observers.watch([(target_frame, source_frame, stamp)],
                                        self.lookup_at, target_frame, source_frame, stamp)
        with self._lock, _Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return Pose._make(se3.IDENTITY)
            return Pose._make(self._tree.ways.pose_at(target_frame, source_frame, stamp))

    def lookup_full(self, target_frame: str, target_stamp: int, source_frame: str,
                    source_stamp: int, fixed_frame: str) -> Pose:
        """
        Return ``target_T_source`` between two times, through a frame that does not move.

        (target <- fixed at target_stamp) (fixed <- source at source_stamp): a thing was
        seen from the source at source_stamp; this gives where it is in the target at
        target_stamp, if it did not move in the fixed frame. Raises as ``lookup`` does.
        """
        return Pose._make(self.lookup_full_stamped(
            target_frame, target_stamp, source_frame, source_stamp, fixed_frame)[1])

    def lookup_full_stamped(self, target_frame: str, target_stamp: int, source_frame: str,
                            source_stamp: int, fixed_frame: str) -> tuple[int, PoseTuple]:
        """Return what ``target_stamp`` came to, and the pose; see ``lookup_full``."""
        if self.observers.hear_lookups():
            return self.observers.watch(
                halves(target_frame, self._stamp_of(target_stamp), source_frame,
                       self._stamp_of(source_stamp), fixed_frame),
                self.lookup_full_stamped, target_frame, target_stamp, source_frame,
                source_stamp, fixed_frame)
        with self._lock, _Naming(target_frame, source_frame):
            self._tree.ways.check_frame('target_frame', target_frame)
            self._tree.ways.check_frame('source_frame', source_frame)
            self._tree.ways.check_frame('fixed_frame', fixed_frame)
            both = [(fixed_frame, source_frame, self._stamp_of(source_stamp)),
                    (target_frame, fixed_frame, self._stamp_of(target_stamp))]
            (_, fixed_T_source), (stamp, target_T_fixed) = self._lookup_both(both)
        return stamp, se3.compose(target_T_fixed, fixed_T_source)

    def _lookup_both(self, halves: list[tuple[str, str, int]]) -> list[tuple[int, PoseTuple]]:
        """Return the answers of two lookups, or raise what one of them lacks."""
        answers: list[tuple[int, PoseTuple]] = []
        errors: list[TransformException] = []
        watched: list[Blocker] = []
        for target_frame, source_frame, stamp in halves:
            try:
                answers.append(self.lookup_stamped(target_frame, source_frame, stamp))
            except TransformException as error:
                errors.append(error)
                watched += error.blocked_on or ()
            else:
                # This half may lose its data during the wait for the other.
                watched += () if stamp == LATEST else self._tree.ways.blockers(
                    target_frame, source_frame, stamp)
        if not errors:
            return answers
        for hopeless in errors:
            if hopeless.blocked_on is None:
                raise hopeless
        errors[0].blocked_on = tuple(watched)
        raise errors[0]

    def latest_common_time(self, target_frame: str, source_frame: str) -> int:
        """
        Return what ``LATEST`` comes to between two frames, nanoseconds.

        ``LATEST`` itself when nothing between them moves. Raises as ``lookup`` does,
        but for extrapolation.
        """
        with self._lock, _Naming(target_frame, source_frame):
            self._tree.ways.check_frame('target_frame', target_frame)
            self._tree.ways.check_frame('source_frame', source_frame)
            if target_frame == source_frame:
                return self._own_stamp(target_frame, LATEST)
            return self._tree.ways.newest_path(target_frame, source_frame).latest_common_time()

    def _own_stamp(self, frame: str, stamp: int) -> int:
        """Return the stamp of a frame's transform to itself: as asked, or its own newest."""
        if stamp != LATEST or frame not in self._tree.histories:
            return stamp
        return self._tree.histories[frame].latest_stamp or LATEST

    def frames_between(self, target_frame: str, source_frame: str,
                       stamp: int = LATEST) -> list[str]:
        """
        Return the frames from the source up to the common ancestor and down to the target.

        Both ends are among them. Raises as ``lookup`` does.
        """
        stamp = self._stamp_of(stamp)
        moment = None if stamp == LATEST else stamp
        with self._lock, _Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return [source_frame]
            return self._tree.ways.branches(target_frame, source_frame, moment).frames()

    def edges_between(self, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> list[EdgeInfo]:
        """
        Return the edges from the source up to the common ancestor and down to the target.

        In that order, each with its parent at the stamp, and the stamps from and to which
        that is its parent. Raises as ``lookup`` does.
        """
        stamp = self._stamp_of(stamp)
        return self._edges_between(
            target_frame, source_frame, None if stamp == LATEST else stamp)

    def _edges_between(self, target_frame: str, source_frame: str,
                       moment: int | None) -> list[EdgeInfo]:
        """Return them at a stamp, 0 among them; None goes by the newest samples."""
        with self._lock, _Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return []
            links = self._tree.ways.branches(target_frame, source_frame, moment).links()
            return [_info_at(parent, history, moment) for parent, history in links]

    # --- many poses

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: npt.ArrayLike,
                    outside: Literal['raise'] = 'raise') -> Array: ...

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: npt.ArrayLike,
                    outside: Literal['mask']) -> tuple[Array, npt.NDArray[np.bool_]]: ...

    def lookup_many(self, target_frame: str, source_frame: str, stamps: npt.ArrayLike,
                    outside: str = 'raise') -> Any:
        """
        Return ``target_T_source`` at many stamps, as ``lookup`` would one by one.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is a time here. Masked ones
            have no answer.
        :param outside: what to do with stamps that have no answer: 'raise', or 'mask' to
            return NaN for them and which are valid.
        :return: (N, 7) poses x y z qx qy qz qw (``se3.as_matrix_many`` makes (N, 4, 4)
            of them); with 'mask' also (N,) booleans.
        :raises InvalidArgumentException: stamps that are no integers or not in one row.
        :raises TransformException: as ``lookup`` does; with 'mask' where a frame is not
            known, or nothing joined the two at any time.

        The numbers are those of ``lookup`` to 1e-12 (metres, and parts of a quaternion);
        where edges are longer than 100 metres, to 1e-14 of their length.
        """
        stamps, given = without_mask(stamps)
        array = self._stamps_of(stamps)
        if outside not in ('raise', 'mask'):
            raise InvalidArgumentException(f"outside is 'raise' or 'mask', not {outside!r}")
        if len(array) and self.observers.hear_lookups():
            return self.observers.watch(
                [(target_frame, source_frame, int(array.max()))],
                self._lookup_many, target_frame, source_frame, array, given, outside)
        return self._lookup_many(target_frame, source_frame, array, given, outside)

    def _lookup_many(self, target_frame: str, source_frame: str, array: Stamps,
                     given: npt.NDArray[np.bool_] | None, outside: str) -> Any:
        with _Naming(target_frame, source_frame):
            poses, valid = self._poses_at(target_frame, source_frame, array)
        if given is not None:
            valid &= given
            poses[~given] = np.nan
        if outside == 'mask':
            return poses, valid
        if not valid.all():
            self._raise_first(target_frame, source_frame, array, given, valid)
        return poses

    def _poses_at(self, target_frame: str, source_frame: str,
                  stamps: Stamps) -> tuple[Array, npt.NDArray[np.bool_]]:
        if target_frame == source_frame:
            return np.tile(se3.IDENTITY, (len(stamps), 1)), np.ones(len(stamps), dtype=bool)
        with self._lock:
            path, was_rehung = self._path_for_all(target_frame, source_frame)
            valid = np.zeros(len(stamps), dtype=bool)
            if path is not None:
                oldest, latest = path.span()
                valid = (stamps >= oldest) & (stamps <= latest)
                inside = stamps if valid.all() else stamps[valid]
                track = path.track(*_ends(inside))
            # Where this path has no data, frames may have hung elsewhere.
            frozen = self.snapshot() if was_rehung and not valid.all() else None
        if path is not None and inside is stamps:
            return track.poses_at(stamps), valid
        poses = np.full((len(stamps), 7), np.nan)
        if path is not None:
            poses[valid] = track.poses_at(inside)
        if frozen is not None:
            frozen._add_one_by_one(target_frame, source_frame, stamps, poses, valid)
        return poses, valid

    def _path_for_all(self, target_frame: str, source_frame: str) -> tuple[Path | None, bool]:
        """Return the path if it is fixed, else None; and whether frames ever hung elsewhere."""
        was_rehung = self._tree.ways.was_rehung
        try:
            path = self._tree.ways.newest_path(target_frame, source_frame)
        except ConnectivityException:
            if not was_rehung:
                raise
            return None, True
        return (path if path.fixed else None), was_rehung

    def _add_one_by_one(self, target_frame: str, source_frame: str, stamps: Stamps,
                        poses: Array, valid: npt.NDArray[np.bool_]) -> None:
        """Look up the stamps without an answer one by one: frames may have hung elsewhere."""
        for number in np.flatnonzero(~valid).tolist():
            try:
                poses[number] = self._tree.ways.pose_at(
                    target_frame, source_frame, int(stamps[number]))
            except (ConnectivityException, ExtrapolationException):
                continue
            valid[number] = True

    def _raise_first(self, target_frame: str, source_frame: str, stamps: Stamps,
                     given: npt.NDArray[np.bool_] | None,
                     valid: npt.NDArray[np.bool_]) -> None:
        """Raise the error of ``lookup_at`` for the first stamp that has no answer."""
        first = int(np.argmin(valid))
        count = len(stamps) - int(valid.sum())
        many = (f'{count} of {len(stamps)} stamps have no answer, the first is stamps[{first}]'
                "{}; outside='mask' returns the others")
        if given is not None and not given[first]:
            raise InvalidArgumentException(many.format(', which is masked'))
        stamp = int(stamps[first])
        try:
            self.lookup_at(target_frame, source_frame, stamp)
        except TransformException as error:
            of_all = many.format(f' = {format_stamp(stamp)} s')
            error.hint = f'{error.hint}. {of_all}' if error.hint else of_all
            raise
        raise InvalidArgumentException(
            f'{count} of {len(stamps)} stamps had no answer while this was asked')

    def lookup_tree(self, target_frame: str, stamp: int = LATEST) -> dict[str, Pose]:
        """
        Return ``target_T_frame`` for every frame that can be expressed in the target.

        One pass over the tree. A frame is left out when it hangs on another root, or
        when an edge on the way has no data for the stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time that every moving edge
            of this tree has data for.
        :raises LookupException: nobody published the target.
        :raises InvalidArgumentException: a name that cannot be a frame, or a stamp that is
            no integer.
        """
        stamp = self._stamp_of(stamp)
        with self._lock, _Naming(target_frame, None):
            if stamp == LATEST:
                stamp = self._tree.spanning.newest_of_all(target_frame)
            poses = self._tree.spanning.poses_from(target_frame, stamp)
        return {frame: Pose._make(pose) for frame, pose in poses.items()}

    def _twists_between(self, near: str, far: str, stamps: Stamps) -> Array | None:
        """
        Return how fast a neighbour moves as the other sees it, (N, 6) in its own axes.

        :param stamps: (N,) for which there is data.
        :return: None where the edge between them knows only poses.
        """
        with self._lock:
            for child, parent in (far, near), (near, far):
                history = self._tree.histories.get(child)
                if history is not None and history.fixed_parent and history.parent == parent:
                    break
            else:
                return None
            twists = history.twists(stamps)
            if twists is None or child == far:
                return twists
            # The inverse moves by -Ad_A V: Lynch, Park, "Modern Robotics", section 3.3.
            track = history.track(*_ends(stamps))
        return -carry_many(track.at(stamps).T, twists)

    # --- how sure

    def lookup_uncertain(self, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                         independent: bool = False) -> tuple[Pose, Array]:
        """
        Return ``target_T_source`` and its covariance.

        That is (6, 6) of x, y, z and rotation about x, y, z, in metres^2 and radians^2, as
        ``PoseWithCovariance`` has it, with the target for the parent: t' = t + dt in the
        target's axes, R' = Exp(dr) R about the target's fixed axes through the source's
        origin. The edges' errors are independent of each other; edges without a covariance
        are certain.

        :param stamp: nanoseconds, or ``LATEST``.
        :param independent: whether one edge's errors at two of its stamps have nothing to
            do with each other. Unless told, they may have anything: the answer between two
            stamps is then an upper bound, as it should be for odometry.
        :return: the pose, and the covariance. ROS's ``Buffer`` returns a message.

        Raises as ``lookup`` does.
        """
        found = self._lookup_uncertain(target_frame, source_frame, stamp, independent)
        return Pose._make(found.pose), found.covariance

    def _lookup_uncertain(self, target_frame: str, source_frame: str, stamp: int,
                          independent: bool) -> Uncertain:
        found, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
        return Uncertain(found, pose, total_at(errors, pose))

    def _errors_at(self, target_frame: str, source_frame: str, stamp: int,
                   independent: bool) -> tuple[int, PoseTuple, Errors | None]:
        stamp = self._stamp_of(stamp)
        with self._lock:
            found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
            gathered = gathered_at(
                self._tree, target_frame, source_frame, found, stamp == LATEST)
        return found, pose, gathered.errors(independent)

    def lookup_budget(self, target_frame: str, source_frame: str, stamp: int = LATEST, *,
                      independent: bool = False) -> list[Share]:
        """
        Return what each edge adds to the covariance, the largest part of the position first.

        It answers which calibration is to be improved. To the first order, where the shares
        add up to the covariance of ``lookup_uncertain``. Parameters and errors as there.

        :return: a ``Share`` of each edge that has a covariance.
        """
        _, pose, errors = self._errors_at(target_frame, source_frame, stamp, independent)
        return shares(errors, pose)

    def lookup_uncertain_many(self, target_frame: str, source_frame: str,
                              stamps: npt.ArrayLike, *,
                              independent: bool = False) -> tuple[Array, Array]:
        """
        Return poses and covariances at many stamps, as ``lookup_uncertain`` one by one.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is a time here.
        :return: (N, 7) and (N, 6, 6).

        Raises as ``lookup_many`` does.
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

    def predict(self, target_frame: str, source_frame: str, stamp: int,
                horizon: int) -> Prediction:
        """
        Return ``target_T_source`` at a stamp that may lie beyond the newest data.

        Each edge that does not reach the stamp goes on at the mean twist of its last 0.1 s,
        and turns as its gyroscope saw it where it is aided. The covariance says how wrong
        the same prediction, made from earlier samples, would have been, beside what the
        edges' own covariances say; nothing knows of a brake that was never used before.
        A stamp that all data reaches is looked up.

        :param stamp: nanoseconds; ``LATEST`` predicts nothing.
        :param horizon: nanoseconds; no edge is taken further beyond its newest sample.
        :return: the pose, the covariance (6, 6), and how far ``beyond`` the data it went.
        :raises FutureExtrapolationException: an edge ends further away than the horizon.

        The other errors are those of ``lookup``.
        """
        stamp, horizon = self._stamp_of(stamp), checked_horizon(horizon)
        if self.observers.hear_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.predict, target_frame, source_frame, stamp, horizon)
        with _Naming(target_frame, source_frame):
            with self._lock:
                known = known_beyond(self._tree, target_frame, source_frame, stamp)
            if known is not None:
                return predicted(known, stamp, horizon)
            found = self._lookup_uncertain(target_frame, source_frame, stamp, False)
        return Prediction(Pose._make(found.pose), found.covariance, found.stamp, 0)

    # --- looking around

    def snapshot(self) -> 'Snapshot':
        """
        Return everything as it is now, for several lookups that must agree.

        Costs a copy of the samples, about 20 us for each moving edge of 1,000.
        """
        with self._lock:
            return Snapshot(self._tree.copy())

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [_info(history.parent, history)
                    for history in histories if history.parent is not None]

    def __repr__(self) -> str:
        return f'<{self._summary()}>'

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the tree."""
        return as_html(self._summary(), Queries.edges(self))

    def _summary(self) -> str:
        # ROS's Buffer has an edges() of its own, which may ask the graph for the publishers.
        return f'{type(self).__name__}: {summary(len(self.frames()), Queries.edges(self))}'


class Snapshot(Queries):
    """
    A buffer's contents at one moment, which never change.

    It answers every question that a buffer answers. All answers agree with each other,
    whatever arrives in the buffer meanwhile. It can be pickled, to keep it in a file or to
    send it to another process.
    """

    def __getstate__(self) -> dict[str, Any]:
        with self._lock:
            state = {**self.__dict__, '_tree': self._tree.copy()}
        del state['_lock']
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._lock = threading.RLock()


class _Naming:
    """Puts the frames of a question into its error."""

    __slots__ = ('frames',)

    def __init__(self, target_frame: str, source_frame: str | None) -> None:
        self.frames = target_frame, source_frame

    def __enter__(self) -> None:
        """Nothing is to be done before."""

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, TransformException):
            error.target_frame, error.source_frame = self.frames


def _info_at(parent: str, history: History, moment: int | None) -> EdgeInfo:
    """Return what is stored of an edge for as long as it has the parent of a moment."""
    info = _info(parent, history)
    if moment is None or history.fixed_parent:
        return info
    since, until = next((since, until) for _, since, until
                        in history.parents_between(BEGINNING, FOREVER) if since <= moment < until)
    stamps = history.track(since, min(info.latest, until - 1)).knots
    return info._replace(oldest=since, latest=int(stamps[stamps < until][-1]))


def _info(parent: str, history: History) -> EdgeInfo:
    return EdgeInfo(parent, history.child, history.authority, history.is_static, len(history),
                    history.oldest_stamp or 0, history.latest_stamp or 0)


def _ends(stamps: Stamps) -> tuple[int, int]:
    return (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)
