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
All questions to a tree: one pose, many, how sure they are, and what there is.

The buffer, whose tree changes, and a snapshot, whose tree does not, share them.
"""

from functools import partial
import importlib
import os
import threading
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from .corrections import correction_of
from .frozen import freeze, Frozen, read_tree, thaw, write_frozen
from .lookups import Lookups, Naming
from .many_stamps import poses_at, refuse_missing
from .outline import as_html, EdgeInfo, info_of, summary
from .prediction import checked_horizon, known_beyond, predicted, Prediction
from .propagation import Errors, total_at
from .samples import samples_around, stamps_of, twists_between
from .uncertain import covariances_at, gathered_at, Share, shares, Uncertain
from ..arrivals.observers import asked
from ..errors import InvalidArgumentException
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..times import Stamps, without_mask


class Queries(Lookups):
    """All that can be asked of a tree, from any thread; see ``Lookups`` about stamps."""

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
        with Naming(target_frame, source_frame):
            poses, valid = poses_at(self._tree, self._lock, target_frame, source_frame, array)
        if given is not None:
            valid &= given
            poses[~given] = np.nan
        if outside == 'mask':
            return poses, valid
        refuse_missing(partial(self.lookup_at, target_frame, source_frame), array, given, valid)
        return poses

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
        with self._lock, Naming(target_frame, None):
            if stamp == LATEST:
                stamp = self._tree.spanning.newest_of_all(target_frame)
            poses = self._tree.spanning.poses_from(target_frame, stamp)
        return {frame: Pose._make(pose) for frame, pose in poses.items()}

    def _twists_between(self, near: str, far: str, stamps: Stamps) -> Array | None:
        with self._lock:
            return twists_between(self._tree, near, far, stamps)

    # --- how sure

    @property
    def has_covariances(self) -> bool:
        """Return whether any edge ever got a covariance."""
        return bool(self._tree.uncertainty)

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
        :param independent: whether one edge's errors at two of its stamps are independent.
            If not, they may be correlated in any way, and the answer between two stamps is
            an upper bound, as it should be for odometry.
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

        It answers which calibration is to be improved. The shares are of the first order:
        where angles are small, they add up to the covariance of ``lookup_uncertain``.
        Parameters and errors as there.

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
        and turns as its gyroscope measured, if it is aided. The covariance has two parts:
        the errors of the same prediction made from earlier samples, and the edges' own
        covariances. It cannot foresee a brake that was never used before. A stamp that all
        data reaches is looked up.

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
        with Naming(target_frame, source_frame):
            with self._lock:
                known = known_beyond(self._tree, target_frame, source_frame, stamp)
            if known is not None:
                return predicted(known, stamp, horizon)
            found = self._lookup_uncertain(target_frame, source_frame, stamp, False)
        return Prediction(Pose._make(found.pose), found.covariance, found.stamp, 0)

    # --- corrections

    @property
    def corrections_version(self) -> int:
        """Return how many corrections and switches there were; it only grows."""
        return self._tree.corrections

    def correction_of(self, child: str) -> Pose:
        """
        Return the correction that an edge has, or goes over to.

        ``parent_T_child`` is this times what was inserted, once the blend is over. The
        identity where there was none.
        """
        with self._lock:
            return correction_of(self._tree, child)

    # --- looking around

    def snapshot(self) -> 'Snapshot':
        """
        Return everything as it is now, for several lookups that must agree.

        Costs a copy of the samples, about 20 us for each moving edge of 1,000.
        """
        with self._lock:
            return Snapshot(self._tree.copy())

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write everything as it is now into a file, which ``load`` opens in no time.

        Covariances, splines and gyroscopes are kept as well.

        :param path: such as ``run.tftree``; a file that is there is replaced, in one step.
        :raises TreeFileError: no place for the file.
        """
        write_frozen(self._frozen(), path)

    def record(self, path: str | os.PathLike[str]) -> None:
        """
        Write all poses as they are now as a bag, which ``ros2 bag play`` and viewers open.

        Needs ``pip install 'tf_tree_py[bag]'``. ``open_bag`` makes the same buffer of it, but
        a bag has no place for some things: a spline becomes poses, ten for each of its pieces;
        covariances, and the samples of gyroscopes, are left out.

        :param path: of a file, such as ``incident.mcap``; without that suffix, of a folder.
        :raises TreeFileError: something is there already, or there is no place for it.
        """
        with self._lock:
            still = self._tree.copy()
        # The layer that knows bags stands above this one, so nothing here imports it by itself.
        importlib.import_module('tf_tree_py.bag.recorder').record(still, path)

    def _frozen(self) -> Frozen:
        with self._lock:
            still = self._tree.copy()
        return freeze(still)

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [info_of(history.parent, history)
                    for history in histories if history.parent is not None]

    def parents_at(self, stamp: int) -> dict[str, str]:
        """
        Return the parent of each frame at a stamp; a frame hangs on none without data for it.

        :param stamp: nanoseconds; 0 is a time here.
        """
        stamp = self._stamp_of(stamp)
        with self._lock:
            parents = {child: history.parent_at(stamp)
                       for child, history in self._tree.histories.items()}
        return {child: parent for child, parent in parents.items() if parent is not None}

    def stamps_of(self, frame: str) -> Stamps:
        """
        Return the stamps of the samples that say where a frame is in its parent.

        :return: (N,) nanoseconds, in order; none of a static edge, or of a root.
        """
        with self._lock:
            return stamps_of(self._tree.histories.get(frame))

    def samples_around(self, child_frame: str, stamp: int) -> list[tuple[int, Pose]]:
        """
        Return the samples of a frame's edge at or next to a stamp, with their own stamps.

        One where the stamp is a sample's, or lies outside of what is stored; two between
        two samples; none where the edge does not move or is not known.

        :param stamp: nanoseconds; 0 is a time here.
        """
        with self._lock:
            return samples_around(self._tree.histories.get(child_frame), stamp)

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

    def snapshot(self) -> 'Snapshot':
        """Return this one, for it never changes."""
        return self

    def _frozen(self) -> Frozen:
        with self._lock:  # for the caches of histories; the samples never change
            return freeze(self._tree)

    def __getstate__(self) -> dict[str, Any]:
        state = {**self.__dict__, '_tree': self._frozen().as_bytes()}
        del state['_lock']
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _tree=thaw(state['_tree']))
        self._lock = threading.RLock()


def load(path: str | os.PathLike[str]) -> Snapshot:
    """
    Open what ``save`` of a buffer wrote: it answers exactly as the buffer did then.

    Opening takes a few milliseconds, whatever the size; what lookups need is read from the
    file when they need it, so the file has to stay.

    :raises TreeFileError: nothing that can be read, what is no frozen tree, or half of one.
    """
    return Snapshot(read_tree(path))
