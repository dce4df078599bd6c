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
The history of an edge that a gyroscope aids: it measures the rotation between two poses.

As in the preintegration of Forster et al., "On-Manifold Preintegration for Real-Time
Visual-Inertial Odometry", IEEE T-RO 33(1), 2017. The error of the gyroscope, which is mostly
its bias, is spread evenly over the time from one pose to the next.
"""

from collections.abc import Sequence
import math

import numpy as np

from .discrete import DynamicHistory, HeldHistory
from .packed import POSE_BYTES, unpack_pose
from .protocol import History
from .storage import Arrays, Facts, Stored
from .track import EdgeTrack, InterpolatedTrack
from ..errors import InvalidArgumentException
from ..geometry import se3, so3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array, Quaternion
from ..stamp import NANOSECONDS_PER_SECOND
from ..times import Stamps


class Gyro:
    """
    The orientation over time by a gyroscope, relative to that at its first sample.

    64 bytes a sample, over the same window as the poses. From one sample to the next it
    turns at the mean of the two rates.
    """

    __slots__ = ('orientations', '_rate')

    def __init__(self, cache_time: int) -> None:
        self.orientations = DynamicHistory('', cache_time)
        self._rate = (0.0, 0.0, 0.0)

    def extend(self, stamps: Stamps, rates: Array) -> int:
        """
        Take samples that are newer than all before; return how many.

        :param stamps: (N,) sorted.
        :param rates: (N, 3) radians a second, in the child's axes.
        """
        known = self.orientations
        before = known.latest_stamp
        taken = 0
        for stamp, rate in zip(stamps.tolist(), rates.tolist(), strict=True):
            if before is not None and stamp <= before:
                continue
            pose = se3.IDENTITY
            if before is not None:
                pose = self._turned(rate, (stamp - before) / NANOSECONDS_PER_SECOND)
            known.insert(stamp, 'start', pose)
            before, self._rate = stamp, rate
            taken += 1
        return taken

    def _turned(self, rate: Sequence[float], seconds: float) -> PoseTuple:
        known = self.orientations
        assert known.latest_stamp is not None
        *_, qx, qy, qz, qw = known.sample(known.latest_stamp)
        x, y, z = (0.5 * seconds * (old + new) for old, new in zip(self._rate, rate, strict=True))
        turned = so3.multiply((qx, qy, qz, qw), so3.exp((x, y, z)))
        return (0.0, 0.0, 0.0, *so3.normalize(turned))

    def turn(self, begin: int, end: int) -> Quaternion | None:
        """Return the rotation from one stamp to another, in the child's axes; None if unknown."""
        known = self.orientations
        if not covers(known, begin, end):
            return None
        first, last = known.sample(begin), known.sample(end)
        return so3.multiply(so3.conjugate(_rotation(first)), _rotation(last))

    def copy(self) -> 'Gyro':
        """Return one of its own with the same samples."""
        twin = Gyro(self.orientations.cache_time)
        twin.orientations, twin._rate = self.orientations.copy(), self._rate
        return twin


class AidedHistory(DynamicHistory):
    """
    Poses, and the gyroscope that measures the rotation between them where it has samples.

    R(t) = R0 dR(t) Exp(u r). dR is the rotation by the gyroscope since the pose before, u the
    part of the time that has passed, and r = Log(dR(t1)^-1 R0^-1 R1) the error that is left
    at the next pose. So the rotation agrees exactly with both poses. Translations go
    straight, as elsewhere.

    :ivar gyro: the orientations by the gyroscope.
    """

    __slots__ = ('gyro',)

    def __init__(self, child: str, cache_time: int, authority: str = '') -> None:
        super().__init__(child, cache_time, authority)
        self.gyro = Gyro(cache_time)

    def clear(self) -> None:
        """Forget every sample, and those of the gyroscope."""
        super().clear()
        self.gyro = Gyro(self.cache_time)

    def copy(self) -> 'AidedHistory':
        """Return a history of its own with the same samples."""
        twin = super().copy()
        twin.gyro = self.gyro.copy()
        return twin

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add to arrays what is in the window."""
        # The last rate is left out: only adding samples needs it, and nothing can be added.
        return super().frozen(arrays) | {'gyro': self.gyro.orientations.frozen(arrays)}

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> 'AidedHistory':
        """Return what was frozen, which uses the memory where it lies; nothing can be added."""
        history = super().thawed(child, stored)
        history.gyro.orientations = DynamicHistory.thawed('', stored.part('gyro'))
        return history

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the pose at a stamp; see the top of the class.

        :raises ExtrapolationException: the stamp lies outside the stored span, or where the
            edge had ended. The gyroscope's samples after the last pose change nothing.
        """
        index = self._index_at(stamp)
        if index is None:
            raise self.extrapolation(stamp)
        straight = super().sample(stamp)
        begin = self._stamps[index]
        if stamp == begin or self._parents and self._parents[index] != self._parents[index + 1]:
            return straight
        end = self._stamps[index + 1]
        gone, whole = self.gyro.turn(begin, stamp), self.gyro.turn(begin, end)
        if gone is None or whole is None:
            return straight
        first, last = (_rotation(unpack_pose(self._poses, number * POSE_BYTES))
                       for number in (index, index + 1))
        left = so3.log(so3.multiply(so3.conjugate(so3.multiply(first, whole)), last))
        ratio = (stamp - begin) / (end - begin)
        closing = so3.exp((ratio * left[0], ratio * left[1], ratio * left[2]))
        return (*straight[:3], *so3.multiply(so3.multiply(first, gone), closing))

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups from one stamp to another need."""
        stamps, poses = self.copy_between(first, last)
        known = self.gyro.orientations
        if known.oldest_stamp is None or known.latest_stamp is None:
            return InterpolatedTrack(stamps, poses)
        begin, end = (max(known.oldest_stamp, min(known.latest_stamp, int(stamp)))
                      for stamp in stamps[[0, -1]])
        return AidedTrack(stamps, poses, InterpolatedTrack(*known.copy_between(begin, end)))


class AidedTrack(InterpolatedTrack):
    """
    Samples of an edge, and of the gyroscope that tells the rotation between them.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    :param gyro: the orientations by the gyroscope.
    """

    def __init__(self, knots: Stamps, poses: Array, gyro: InterpolatedTrack) -> None:
        super().__init__(knots, poses)
        self._gyro = gyro

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) some time after stamps."""
        poses = np.array(super().at(stamps, since))
        before, after = self._around(stamps)
        begins, ends = self.knots[before], self.knots[after]
        aided = ((begins < ends) & (begins >= self._gyro.knots[0])
                 & (ends <= self._gyro.knots[-1]))
        passed = np.asarray(stamps - begins, dtype=float)
        if since is not None:
            passed = passed + since
        whole = passed.astype(np.int64)
        rotations = _aided(
            _rotations(self._gyro.at(begins)), _rotations(self._gyro.at(ends)),
            _rotations(self._gyro.at(begins + whole, passed - whole)),
            _rotations(self._poses.take(before, axis=1)),
            _rotations(self._poses.take(after, axis=1)), passed / np.maximum(ends - begins, 1))
        poses[3:] = np.where(aided, np.moveaxis(rotations, -1, 0), poses[3:])
        return poses

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return infinity: between two poses it may turn in any way."""
        return math.inf, math.inf


def _rotations(poses: Array) -> Array:
    """Return the quaternions (..., 4) of poses (7, ...)."""
    return np.moveaxis(poses[3:], 0, -1)


def _aided(gyro_begin: Array, gyro_end: Array, gyro_now: Array, first: Array, last: Array,
           ratio: Array) -> Array:
    """Return the rotations (..., 4) of ``AidedHistory``, out of orientations (..., 4)."""
    back = so3.conjugate_many(gyro_begin)
    gone, whole = so3.multiply_many(back, gyro_now), so3.multiply_many(back, gyro_end)
    left = so3.log_many(so3.multiply_many(
        so3.conjugate_many(so3.multiply_many(first, whole)), last))
    return so3.multiply_many(so3.multiply_many(first, gone),
                             so3.exp_many(ratio[..., None] * left))


def aided(history: History | None, child: str, cache_time: int) -> AidedHistory:
    """
    Return an edge's history as one that a gyroscope aids: itself, or a new one with its samples.

    :param history: None where nothing is known of the edge yet.
    :raises InvalidArgumentException: an edge that does not move between its samples.
    """
    if history is None:
        return AidedHistory(child, cache_time)
    if isinstance(history, AidedHistory):
        return history
    if not isinstance(history, DynamicHistory) or isinstance(history, HeldHistory):
        what = 'is static' if history.is_static else 'has a motion of its own between its samples'
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}: a gyroscope cannot aid it. Name the '
            'moving edge that turns with the gyroscope, such as odom -> base_link by its child')
    return history.copied_into(AidedHistory(child, cache_time, history.authority))


def turn_of(history: History, begin: int, end: int) -> Quaternion | None:
    """Return how an edge's child turned by its gyroscope; None if there is none for all of it."""
    return history.gyro.turn(begin, end) if isinstance(history, AidedHistory) else None


def gyro_until(history: History) -> int | None:
    """Return the stamp of the newest sample of an edge's gyroscope; None if there is none."""
    return history.gyro.orientations.latest_stamp if isinstance(history, AidedHistory) else None


def covers(history: DynamicHistory, begin: int, end: int) -> bool:
    """Return whether there are samples from one stamp to another."""
    oldest, latest = history.oldest_stamp, history.latest_stamp
    return oldest is not None and latest is not None and oldest <= begin and end <= latest


def _rotation(pose: PoseTuple) -> Quaternion:
    return (pose[3], pose[4], pose[5], pose[6])
