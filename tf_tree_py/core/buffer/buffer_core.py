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
The buffer: a tree behind one lock, fed, asked and waited for, without ROS.

Every public method may be called from any thread. While the lock is held, no long
computation runs, and of callers' code only the query that ``wait_for`` was given.
"""

from collections.abc import Callable, Iterable
import importlib
import math
import os
from typing import Any, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from .correcting import (
    checked_frame,
    checked_limits,
    checked_motion,
    checked_point,
    DEFAULT_OVER,
)
from .deadline import Deadline, WallDeadline
from .intake import Intake
from .refusals import Refusals
from .switching import checked_rule, checked_source, DEFAULT_WINDOW, Switching
from .waiting import Waiting
from ..arrivals.future_guard import FutureGuard
from ..arrivals.incidents import Incident, Statistics
from ..arrivals.jump_back import JumpBack
from ..arrivals.observers import asked, AUDIT_FOLDER, Observers
from ..arrivals.sample import admitted, Batch, Sample
from ..arrivals.track import checked_rates, checked_track
from ..edges.correction import ORIGIN
from ..edges.spline import Spline
from ..errors import InvalidArgumentException
from ..geometry.covariances import checked_covariance
from ..geometry.pose import Pose
from ..geometry.poses import checked_pose
from ..geometry.se3 import PoseTuple
from ..stamp import from_seconds, LATEST
from ..times import checked_cache_time
from ..tree.corrections import absorb, Transition
from ..tree.queries import Queries, Snapshot
from ..tree.sources import Source
from ..tree.tree import Tree

Answer = TypeVar('Answer')

DEFAULT_CACHE_TIME = from_seconds(10.0)
DEFAULT_MAX_FRAMES = 20_000
DEFAULT_MAX_NAME_BYTES = 1024
DEFAULT_AUTHORITY = 'default_authority'


class BufferCore(Queries):
    """
    Transforms between frames, over a window of time. ``Queries`` has the lookups.

    A lookup costs O(depth log n), an insertion O(1) amortised when it is the
    newest of its edge.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s unless given,
        and with ``UNLIMITED`` everything.
    :param max_frames: how many frame names are taken: a hostile publisher may send any
        number.
    :param max_name_bytes: how many bytes of UTF-8 a frame name may have, likewise.
    :param now: the clock that the stamps are taken from, nanoseconds, such as
        ``time.time_ns``; stamps far ahead of it are reported. None: stamps may be of any
        time.
    :param max_future: how far ahead of the clock a stamp may be, nanoseconds; what is
        further is refused. None: it is taken, as in tf2.
    :param clear_on_jump_back: forget what moves when stamps jump back by more than this,
        nanoseconds, as those of a looping bag do: see ``JumpBack``. None: refuse what is
        older than the window, as tf2 does.
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
        """All who wait for data; its length is how many."""
        self.observers = Observers()
        self.intake = Intake(
            tree, self.waiting, self.observers, FutureGuard(now, max_future),
            None if clear_on_jump_back is None else JumpBack(clear_on_jump_back))
        """The way in, for those who feed the buffer what was checked already."""
        self._refusals = Refusals()
        self._switching = Switching(tree, self.waiting, self.intake)
        if AUDIT_FOLDER in os.environ:
            # tf_audit runs this program; what it switches on stands above this file.
            importlib.import_module('tf_tree_py.core.telling.audit_file').watch(self)

    def __reduce__(self) -> NoReturn:
        raise TypeError(f'a {type(self).__name__} can be neither pickled nor copied, for others '
                        'may wait in it: its snapshot() can')

    # --- inserting

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None,
               covariance: npt.ArrayLike | None = None) -> list[Incident]:
        """
        Take one transform.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; of no meaning when static.
        :param static: valid at all times.
        :param strict: True raises what is refused; None warns of it, once for each kind;
            False does neither, for programs that look at what is returned.
        :param covariance: (6, 6) of x, y, z and rotation about x, y, z, metres^2 and
            radians^2, as ``PoseWithCovariance`` has it: t' = t + dt in the parent's axes,
            R' = Exp(dr) R about the parent's fixed axes through the child's origin. None:
            it is not known, and the one before it stays.
        :return: what was refused or is worth telling: empty when all is well.
        :raises InvalidArgumentException: an invalid stamp, pose or covariance, or a name that
            is no string.
        :raises RefusedException: with ``strict``, after all that is good was taken.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        if covariance is None:
            return self._refusals.report(self.intake.take([sample], authority, static), strict)
        return self._refusals.report(self.intake.take_uncertain(
            sample, checked_covariance(covariance), authority, static), strict)

    def insert_many(self, samples: Iterable[Sample], authority: str = DEFAULT_AUTHORITY,
                    static: bool = False, *, strict: bool | None = None) -> list[Incident]:
        """
        Take transforms under one lock; see ``insert``.

        If one of the names or stamps is invalid, nothing is taken.
        """
        samples = [admitted(sample) for sample in samples]
        return self._refusals.report(self.intake.take(samples, authority, static), strict)

    def insert_track(self, parent: str, child: str, stamps: npt.ArrayLike, poses: Any, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Take many samples of one moving edge, as ``insert`` would one by one.

        It costs about as much as copying memory, unless some are older than the buffer keeps.

        :param stamps: (N,) nanoseconds, in order of arrival.
        :param poses: ``parent_T_child``: (N, 7) metres and quaternion x y z w, (N, 4, 4)
            matrices, or N poses of any kind that ``insert`` takes.
        :param strict: as ``insert`` has it; unless it is False, samples that the buffer
            does not keep are warned of too.
        :return: what was refused or is worth telling: empty when all is well.
        :raises InvalidArgumentException: invalid stamps or poses, or not as many of both.
        :raises RefusedException: with ``strict``, after all that is good was taken.
        """
        track = checked_track(parent, child, self._stamps_of(stamps), poses)
        incidents = self.intake.take_track(track, authority)
        if strict is not False and track.span > self.cache_time:
            self._refusals.report_lost(track.gone(self.cache_time))
        return self._refusals.report(incidents, strict)

    def insert_spline(self, parent: str, child: str, spline: Spline, *,
                      authority: str = DEFAULT_AUTHORITY,
                      strict: bool | None = None) -> list[Incident]:
        """
        Let an edge move on a spline, from where it begins to where it ends.

        It replaces what was stored of the edge, also its last spline. So the spline of a
        ``SplineFitter`` can be inserted after every ``add``. A sample that is inserted later
        makes the edge an ordinary one again. All of a spline is kept, whatever ``cache_time``
        is.

        :param spline: ``parent_T_child``.
        :param strict: as ``insert`` has it.
        :return: what was refused or is worth telling: empty when all is well.
        :raises InvalidArgumentException: not a spline, or a name that is no string.
        :raises RefusedException: with ``strict``, when it was refused.
        """
        if not isinstance(spline, Spline):
            raise InvalidArgumentException(
                f'Invalid argument spline: this {type(spline).__name__} is none. Spline.fit '
                'makes one of stamps and poses')
        for name, frame in (('parent', parent), ('child', child)):
            if not isinstance(frame, str):
                raise InvalidArgumentException(f'{name} is the name of a frame, not {frame!r}')
        return self._refusals.report(self.intake.take_spline(
            parent.removeprefix('/'), child.removeprefix('/'), spline, authority), strict)

    def aid(self, child: str, stamps: npt.ArrayLike, angular_velocities: npt.ArrayLike) -> int:
        """
        Take the angular velocities of a gyroscope, for lookups between an edge's poses.

        Where the gyroscope has samples for all the time between two poses, the rotation
        between them is from now on the one that it measured, and agrees exactly with both
        poses. Elsewhere it is interpolated as before. Translations and the poses themselves
        stay.

        :param child: the edge's child frame, whose poses may come later.
        :param stamps: (N,) nanoseconds.
        :param angular_velocities: (N, 3) radians a second, of the child as the parent sees
            it, in the child's axes: what a gyroscope in the child measures where the parent
            does not turn, such as odom.
        :return: how many were taken: those that are newer than all before.
        :raises InvalidArgumentException: shapes that do not fit, rates that are not finite,
            invalid stamps, or an edge that does not move between its samples.
        """
        times = self._stamps_of(stamps)
        child = checked_frame(child)
        rates = checked_rates(angular_velocities, len(times))
        order = np.argsort(times, kind='stable')
        return self.intake.take_rates(child, times[order], rates[order])

    def insert_batch(self, batch: Batch, authority: str = DEFAULT_AUTHORITY,
                     static: bool = False) -> list[Incident]:
        """Take a whole message under one lock; see ``insert``."""
        return self.intake.take_batch(batch, authority, static)

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        return self.intake.statistics()

    # --- corrections

    def correct(self, child: str, correction: Any, over: int = DEFAULT_OVER, *,
                max_speed: float = math.inf, max_turn_rate: float = math.inf,
                stamp: int | None = None, about: npt.ArrayLike = ORIGIN,
                reach: float = 0.0) -> Transition:
        """
        Let an edge absorb a correction, without a jump.

        In the end ``parent_T_child`` is the correction times what is inserted. A correction
        replaces the one before, so giving it twice does no harm. It begins at the edge's
        newest sample, so answers that were given stay true. From there the edge is blended
        over stamps, by a quintic that begins with the present value and rate.

        :param correction: of any kind that ``insert`` takes as a pose.
        :param over: how long the blend takes at least, nanoseconds.
        :param max_speed: metres a second that the blend adds at most to the speed of the
            edge's child; the blend takes as long as that takes.
        :param max_turn_rate: radians a second, likewise.
        :param stamp: when the correction was measured: the stamp of an image, for instance.
            Only ``smoothed()`` uses it. None: at the newest sample.
        :param about: the point of the child, in its coordinates, that ``max_speed`` holds
            for; it turns about it. What lies r metres from there may gain r times the turn
            rate besides.
        :param reach: ``max_speed`` holds as far from there, metres.
        :return: when it begins and ends, and its number.
        :raises InvalidArgumentException: an edge without samples, or that is static or a
            spline; an invalid pose, stamp or limit.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        motion = checked_motion(correction)
        seen_at = None if stamp is None else self._stamp_of(stamp)
        place = checked_point(about)
        with self._lock:
            return absorb(self._tree, checked_frame(child), motion, seen_at, place, limits)

    def smoothed(self) -> Snapshot:
        """
        Return a snapshot with all corrections applied to the past, too.

        The live tree is wrong while it blends, for the sake of those who must not see jumps,
        and its past is never corrected. In this snapshot every sample has the correction of
        its own stamp; between two corrections it is interpolated. An edge with several
        sources follows the active one from its beginning on. For maps and post-processing.
        """
        return Snapshot(self._switching.smoothed())

    # --- several sources of one edge

    def insert_from(self, source: str, parent: str, child: str, stamp: int,
                    pose: PoseTuple) -> list[Incident]:
        """
        Take a transform of one of several sources of an edge.

        The samples of all sources are kept, and lookups are answered by one source: the first
        that was heard, unless ``switch`` or the rule says otherwise.

        :param source: its name, such as 'wheels'; also the authority.
        :return: what was refused or is worth telling, and which source made way.
        :raises InvalidArgumentException: an invalid stamp, pose or name, or another parent
            than that of the other sources.

        The other parameters are those of ``insert``.
        """
        source = checked_source(source)
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self._switching.take(source, sample)

    def switch(self, child: str, to: str, over: int = DEFAULT_OVER, *,
               max_speed: float = math.inf, max_turn_rate: float = math.inf,
               reach: float = 0.0) -> Transition | None:
        """
        Let an edge go over to another of its sources, as it goes over to a correction.

        The blend begins where the edge is, and ends at the other source's poses. The edge's
        corrections end, too, for they were made for the source before.

        :param to: the name of a source that was heard already.
        :return: when it begins and ends; None if it has to wait: a source that lags behind
            takes over when it has reached the edge's newest sample.
        :raises InvalidArgumentException: no such source, the active one, or one that began
            after the edge's newest sample.

        The other parameters are those of ``correct``.
        """
        return self._switching.switch(
            child, to, checked_limits(over, max_speed, max_turn_rate, reach))

    def switch_by_rule(self, child: str, *, max_age: int, gate: tuple[float, float] | None = None,
                       window: int = DEFAULT_WINDOW, over: int = DEFAULT_OVER,
                       max_speed: float = math.inf, max_turn_rate: float = math.inf,
                       reach: float = 0.0) -> None:
        """
        Replace the active source of an edge when it fails; each time is an incident.

        A source that falls silent is replaced by that one of the others which was heard first.
        One that moves otherwise than the others is replaced by the largest group of sources
        that agree; of groups of one size, by that with the source that was heard first. The
        rule is judged whenever a sample of any source arrives: nothing polls.

        :param max_age: how far a source's newest sample may lie behind that of another,
            nanoseconds.
        :param gate: by how many metres and radians the motions of two sources over the
            window may differ; None: by any.
        :param window: nanoseconds; with a gate shorter than ``cache_time``.
        :raises InvalidArgumentException: an edge that has no sources, or an invalid limit.

        One stamp of the far future makes all others silent: ``max_future`` keeps such out.

        The other parameters are those of ``correct``.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        self._switching.switch_by_rule(child, checked_rule(max_age, gate, window, limits))

    def sources_of(self, child: str) -> list[Source]:
        """Return the sources of an edge, those heard first before the others."""
        return self._switching.sources_of(child)

    # --- waiting

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """
        Return a query's answer as soon as it has one.

        Sleeps until what blocks the query arrives; nothing is polled.

        :param query: such as ``lambda: buffer.lookup('map', 'camera', stamp)``; with the
            lock held, so that nothing arrives between its failure and the wait.
        :param deadline: how long to wait.
        :raises TransformException: the query's own error, with ``waited_s``, when time
            is up; or at once when waiting cannot help, as for a stamp that is older than the
            buffer keeps.
        """
        return self.waiting.wait_for(query, deadline)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> Pose:
        """Return ``lookup``; wait for the data for at most this many seconds of wall time."""
        return self.observers.watch(
            [asked(target_frame, source_frame, stamp)], lambda: self.wait_for(
                lambda: self.lookup(target_frame, source_frame, stamp), WallDeadline(timeout_s)))

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        self.intake.clear()

    def start_anew(self, why: str) -> None:
        """
        Forget what moves, because another time has begun, and tell everybody who waits.

        :param why: the beginning of a sentence.
        """
        self.intake.start_anew(why)

    def remove_frame(self, frame: str) -> bool:
        """
        Forget a frame's edge, and its name unless another hangs on it.

        :return: whether it was known.
        """
        with self._lock:
            known = self._tree.remove(frame)
        if known:
            self.waiting.ask_again()
        return known
