# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The buffer, without ROS: a tree with a lock, insertion, lookups and waiting.

Every public method is thread-safe. While the lock is held, no long computation runs, and the
only code of callers that runs is the query passed to ``wait_for``.
"""

from collections.abc import Callable, Iterable, Sequence
import importlib
import math
import os
from typing import NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from .correction_arguments import (
    checked_frame,
    checked_limits,
    checked_motion,
    checked_point,
    DEFAULT_OVER,
)
from .deadline import Deadline, WallDeadline
from .intake import Intake
from .refusal_warnings import RefusalWarnings
from .switching import (
    checked_rule,
    checked_source,
    DEFAULT_STEADY,
    DEFAULT_WINDOW,
    Switching,
)
from .waiting import Waiting
from ..edges.curve import as_edge_curve, Curve
from ..edges.stage import ORIGIN
from ..errors import InvalidArgumentException
from ..geometry.covariances import checked_covariance
from ..geometry.pose import Pose
from ..geometry.poses import checked_pose, PoseLike, PosesLike
from ..ingest.future_guard import FutureGuard
from ..ingest.incidents import Incident, Statistics
from ..ingest.jump_back import JumpBack
from ..ingest.observers import asked, AUDIT_FOLDER, Observers
from ..ingest.sample import admitted, Batch, Sample
from ..ingest.sample_track import checked_rates, checked_track
from ..stamp import from_seconds, LATEST
from ..times import checked_cache_time, Stamp, StampsLike
from ..tree.corrections import absorb, Transition
from ..tree.queries import Queries
from ..tree.tree import Tree

Answer = TypeVar('Answer')

DEFAULT_CACHE_TIME = from_seconds(10.0)
DEFAULT_MAX_FRAMES = 20_000
DEFAULT_MAX_NAME_BYTES = 1024
DEFAULT_AUTHORITY = 'default_authority'


class BufferCore(Queries):
    """
    Transforms between frames over a window of time. ``Queries`` has the lookups.

    A lookup costs O(depth log n). The insertion of an edge's newest sample costs O(1)
    amortised.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s by default;
        ``UNLIMITED`` keeps everything.
    :param max_frames: the maximum number of frame names, which limits the damage that a
        hostile publisher can do.
    :param max_name_bytes: the maximum bytes of a frame name in UTF-8, for the same reason.
    :param now: the clock that the stamps are taken from, nanoseconds, such as
        ``time.time_ns``; stamps far ahead of it are reported. None: all stamps are accepted.
    :param max_future: how far ahead of the clock a stamp may be, nanoseconds; later stamps
        are refused. None: they are accepted, as in tf2.
    :param clear_on_jump_back: clear all moving edges when stamps jump back by more than
        this, nanoseconds, as in a looping bag: see ``JumpBack``. None: refuse samples that
        are older than the window, as tf2 does.
    """

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 now: Callable[[], int] | None = None,
                 max_future: int | None = None, clear_on_jump_back: int | None = None) -> None:
        tree = Tree(
            DEFAULT_CACHE_TIME if cache_time is None else checked_cache_time(cache_time),
            max_frames, max_name_bytes)
        super().__init__(tree)
        self.waiting = Waiting(self._lock)
        """The waiters for data; its length is their number."""
        self.observers = Observers()
        self.intake = Intake(
            tree, self.waiting, self.observers, FutureGuard(now, max_future),
            None if clear_on_jump_back is None else JumpBack(clear_on_jump_back))
        """Inserts samples that have already been checked."""
        self._refusals = RefusalWarnings()
        self._switching = Switching(tree, self.waiting, self.intake)
        if AUDIT_FOLDER in os.environ:
            # tf_audit runs this program. A normal import of the audit would go up the layers.
            importlib.import_module('tf_tree_py.core.reports.audit_file').watch(self)

    def __reduce__(self) -> NoReturn:
        raise TypeError(f'a {type(self).__name__} cannot be pickled or copied, because threads '
                        'may wait in it: pickle its snapshot()')

    # --- inserting

    def insert(self, parent: str, child: str, stamp: Stamp, pose: PoseLike, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None,
               covariance: npt.ArrayLike | None = None) -> list[Incident]:
        """
        Insert one transform.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; ignored for static transforms.
        :param static: whether the transform is valid at all times.
        :param strict: True raises an exception if a transform is refused; None issues a Python
            warning, once for each kind; False does neither, for callers that check the returned
            incidents.
        :param covariance: (6, 6) of x, y, z and rotation about x, y, z, metres^2 and
            radians^2, as in ``PoseWithCovariance``: t' = t + dt in the parent's axes,
            R' = Exp(dr) R about the parent's fixed axes through the child's origin. None:
            unknown; the edge keeps its previous covariance.
        :return: the incidents: empty if the transform was inserted without a remark.
        :raises InvalidArgumentException: an invalid stamp, pose or covariance, or a name that
            is not a string.
        :raises RefusedException: with ``strict``, after all valid transforms were inserted.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        if covariance is None:
            return self._refusals.report(self.intake.take([sample], authority, static), strict)
        return self._refusals.report(self.intake.take_uncertain(
            sample, checked_covariance(covariance), authority, static), strict)

    def insert_many(self, samples: Iterable[Sample], authority: str = DEFAULT_AUTHORITY,
                    static: bool = False, *, strict: bool | None = None) -> list[Incident]:
        """
        Insert transforms while holding the lock once; see ``insert``.

        If one of the names or stamps is invalid, none is inserted.
        """
        samples = [admitted(sample) for sample in samples]
        return self._refusals.report(self.intake.take(samples, authority, static), strict)

    def insert_track(self, parent: str, child: str, stamps: StampsLike, poses: PosesLike, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Insert many samples of one moving edge, with the result of single calls of ``insert``.

        It costs about as much as copying memory, unless some are older than the buffer keeps.

        :param stamps: (N,) nanoseconds, in order of arrival.
        :param poses: ``parent_T_child``: (N, 7) metres and quaternion x y z w, (N, 4, 4)
            matrices, or N poses of any kind that ``insert`` takes.
        :param strict: as in ``insert``; unless it is False, a warning also reports samples
            that the buffer does not keep.
        :return: the incidents: empty if all were inserted without a remark.
        :raises InvalidArgumentException: invalid stamps or poses, or different numbers of them.
        :raises RefusedException: with ``strict``, after all valid samples were inserted.
        """
        track = checked_track(parent, child, self._stamps_of(stamps), poses)
        incidents = self.intake.take_track(track, authority)
        if strict is not False and track.span > self.cache_time:
            self._refusals.report_lost(track.gone(self.cache_time))
        return self._refusals.report(incidents, strict)

    def insert_curve(self, parent: str, child: str, curve: Curve, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Replace the samples of an edge with a curve, which is valid from its begin to its end.

        A curve is a ``Spline``, a ``ConstantTwist``, or any other function of time: see
        ``Curve``. It replaces all stored samples of the edge, or its previous curve. So the
        spline of a ``SplineFitter`` can be inserted after every ``add``. A sample that is
        inserted later turns the edge into a sampled one again. The whole curve is kept,
        regardless of ``cache_time``.

        :param curve: ``parent_T_child`` over time; it must not change after the insertion.
        :param strict: as in ``insert``.
        :return: the incidents: empty if it was inserted without a remark.
        :raises InvalidArgumentException: not a curve, or a name that is not a string.
        :raises RefusedException: with ``strict``, if it was refused.
        """
        for name, frame in (('parent', parent), ('child', child)):
            if not isinstance(frame, str):
                raise InvalidArgumentException(f'{name} is the name of a frame, not {frame!r}')
        parent, child = parent.removeprefix('/'), child.removeprefix('/')
        return self._refusals.report(self.intake.take_curve(
            parent, child, as_edge_curve(curve, f'{parent} -> {child}'), authority), strict)

    def aid(self, child: str, stamps: StampsLike, angular_velocities: npt.ArrayLike, *,
            max_gap: int | None = None, saturation: float = math.inf) -> int:
        """
        Insert angular velocities of a gyroscope, for lookups between an edge's poses.

        Between two poses for which the gyroscope has samples without a gap, lookups return the
        rotation that it measured; at both poses this agrees exactly with them. Elsewhere
        the rotation is interpolated as before. Translations and the poses themselves do not
        change.

        :param child: the edge's child frame; its poses may arrive later.
        :param stamps: (N,) nanoseconds.
        :param angular_velocities: (N, 3) radians per second, of the child relative to the
            parent, in the child's axes: the measurements of a gyroscope in the child if the
            parent, such as odom, does not rotate.
        :param max_gap: the longest time between two samples, nanoseconds; in a longer gap the
            gyroscope is not used. None: five of its usual periods.
        :param saturation: the largest rate about one axis that it can measure, radians per
            second; between a sample that reaches it and the next one the gyroscope is not used.
        :return: how many were inserted: those that are newer than all previous ones.
        :raises InvalidArgumentException: mismatched shapes, rates that are not finite,
            invalid stamps or limits, or an edge that is static or a curve.
        """
        if not (max_gap is None or isinstance(max_gap, int) and max_gap > 0) or not (
                saturation > 0.0):
            raise InvalidArgumentException(
                f'max_gap={max_gap!r} must be integer nanoseconds or None, and '
                f'saturation={saturation!r} radians per second; both must be positive')
        times = self._stamps_of(stamps)
        child = checked_frame(child)
        rates = checked_rates(angular_velocities, len(times))
        order = np.argsort(times, kind='stable')
        return self.intake.take_rates(child, times[order], rates[order], max_gap, saturation)

    def insert_batch(self, batch: Batch, authority: str = DEFAULT_AUTHORITY,
                     static: bool = False, *, announced: bool = False) -> list[Incident]:
        """
        Insert a whole message while holding the lock once; see ``insert``.

        :param announced: whether observers were already notified of the message, with its topic.
        """
        return self.intake.take_batch(batch, authority, static, announced)

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        return self.intake.statistics()

    # --- corrections

    def correct(self, child: str, correction: PoseLike, over: int = DEFAULT_OVER, *,
                max_speed: float = math.inf, max_turn_rate: float = math.inf,
                stamp: Stamp | None = None, about: npt.ArrayLike = ORIGIN,
                reach: float = 0.0) -> Transition:
        """
        Correct an edge without a jump: its pose blends to the corrected one.

        When the blend has ended, ``parent_T_child`` is the correction times the inserted pose.
        A correction replaces the previous one. The same correction, point and limits as last
        given for this parent have no effect and return the transition that is in progress. A
        blend begins at the edge's newest sample, so earlier answers stay valid. It begins with
        the current value and rate, so corrections may arrive at any rate, and may be noisy.

        :param correction: any type that ``insert`` accepts as a pose.
        :param over: the minimum duration of a blend from rest, nanoseconds; if a speed is
            limited, at least 0.1 s.
        :param max_speed: the maximum speed that the blend adds to the edge's child, metres per
            second; the blend takes as long as necessary. A lower limit set during a blend
            takes effect after half of ``over``.
        :param max_turn_rate: the same for the rotation, radians per second.
        :param stamp: when the correction was measured, such as the stamp of an image.
            Only ``smoothed()`` uses it. None: the stamp of the newest sample.
        :param about: the point of the child, in its coordinates, that ``max_speed`` holds for
            and that the blend rotates about. A point at a distance of r metres from it may
            additionally gain r times the turn rate.
        :param reach: ``max_speed`` holds for all points up to this distance from ``about``,
            metres. If the edge itself rotates, a point may additionally gain its distance times
            the edge's turn rate times 2 sin(a / 2), with a the angle that remains to be corrected.
        :return: when the blend begins and ends, and the number of the correction.
        :raises InvalidArgumentException: an edge without samples, a static edge or a
            curve; an invalid pose, stamp or limit.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        motion = checked_motion(correction)
        seen_at = None if stamp is None else self._stamp_of(stamp)
        place = checked_point(about)
        with self._lock:
            return absorb(self._tree, checked_frame(child), motion, seen_at, place, limits)

    # --- several sources of one edge

    def insert_from(self, source: str, parent: str, child: str, stamp: Stamp,
                    pose: PoseLike) -> list[Incident]:
        """
        Insert a transform from one of several sources of an edge.

        The samples of all sources are kept. Lookups use one source: the first that sent a
        sample, until ``switch`` or the rule selects another one.

        :param source: its name, such as 'wheels'; also the authority.
        :return: the incidents, including a source that was replaced.
        :raises InvalidArgumentException: an invalid stamp, pose or name, or a parent
            that differs from that of the other sources.

        The other parameters are those of ``insert``.
        """
        source = checked_source(source)
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self._switching.take(source, sample)

    def switch(self, child: str, to: str, over: int = DEFAULT_OVER, *,
               max_speed: float = math.inf, max_turn_rate: float = math.inf,
               reach: float = 0.0) -> Transition | None:
        """
        Switch an edge to another of its sources, with a blend like that of a correction.

        The blend begins at the edge's current pose and ends at the poses of the other source.
        The edge's corrections are removed, because they were measured for the previous source.

        :param to: the name of a source that has sent samples.
        :return: when the blend begins and ends; None if the switch is pending: a source that
            lags behind becomes active when it has reached the edge's newest sample.
        :raises InvalidArgumentException: an unknown source, the active source, a source that
            began after the edge's newest sample, or one that fell silent long before it.

        The other parameters are those of ``correct``.
        """
        return self._switching.switch(
            child, to, checked_limits(over, max_speed, max_turn_rate, reach))

    def switch_by_rule(self, child: str, *, max_age: int, gate: tuple[float, float] | None = None,
                       window: int = DEFAULT_WINDOW, over: int = DEFAULT_OVER,
                       max_speed: float = math.inf, max_turn_rate: float = math.inf,
                       reach: float = 0.0, prefer: Sequence[str] = (),
                       steady: int = DEFAULT_STEADY) -> None:
        """
        Replace the active source of an edge when it fails; each replacement is an incident.

        A source that falls silent is replaced by the oldest of the others. A source whose
        motion differs from that of the others is replaced by one of the largest group of
        sources that agree; of groups of equal size, the one with the oldest source. The oldest
        source is the one that sent its first sample first. The rule is evaluated whenever a
        sample of any source arrives, without polling.

        :param max_age: how far a source's newest sample may lie behind that of another,
            nanoseconds.
        :param gate: by how many metres and radians the motions of two sources over the
            window may differ; None: no limit.
        :param window: nanoseconds; with a gate it must be shorter than ``cache_time``.
        :param prefer: sources, the best first: the edge returns to a better source that is
            steady again. Sources that are not listed come last.
        :param steady: how long a better source must have sent without a pause of max_age before
            the edge returns to it, nanoseconds; with a gate it must also agree.
        :raises InvalidArgumentException: an edge without sources, or an invalid limit.

        One stamp in the far future makes all other sources silent: set ``max_future`` to
        refuse such stamps.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        self._switching.switch_by_rule(child, checked_rule(
            max_age, gate, window, limits, prefer, steady))

    # --- waiting

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """
        Return a query's answer as soon as it has one.

        It sleeps until the data that the query lacks arrives; it does not poll.

        :param query: such as ``lambda: buffer.lookup('map', 'camera', stamp)``. It is called
            with the lock held, so that no data arrives between its failure and the wait.
        :param deadline: how long to wait.
        :raises TransformException: the query's own error, with ``waited_s``, at the deadline;
            or immediately if waiting cannot help, as for a stamp that is older than the
            buffer keeps.
        """
        return self.waiting.wait_for(query, deadline)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: Stamp = LATEST) -> Pose:
        """Return ``lookup``, after waiting at most this many seconds of wall time for data."""
        checked = self._stamp_of(stamp)
        return self.observers.watch(
            [asked(target_frame, source_frame, checked)], lambda: self.wait_for(
                lambda: self.lookup(target_frame, source_frame, checked),
                WallDeadline(timeout_s)))

    # --- forgetting

    def clear(self) -> None:
        """Clear all moving edges; frame names and static edges stay, as in tf2."""
        self.intake.clear()

    def start_anew(self, why: str) -> None:
        """
        Clear all moving edges, because time has restarted, and make all waiters fail.

        :param why: the beginning of the sentence of their error.
        """
        self.intake.start_anew(why)

    def remove_frame(self, frame: str) -> bool:
        """
        Remove a frame's edge, and also its name unless the frame has children.

        :return: whether the frame was known.
        """
        with self._lock:
            known = self._tree.remove(frame)
        if known:
            self.waiting.ask_again()
        return known
