# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge aided by a gyroscope, which measures the rotation between two poses.

The error of the gyroscope, which is mostly its bias, is distributed evenly over the time from
one pose to the next. If the gyroscope did not measure a part of that time, the error is that
of the gap: see ``bridge``.
"""

from collections.abc import Callable
import math
from math import cos, sin
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.histories import DynamicHistory, HeldHistory
from tf_tree_py.core.edges.packed import POSE_BYTES, unpack_pair, unpack_pose
from tf_tree_py.core.edges.protocol import EdgeTrack, History, InterpolatedTrack
from tf_tree_py.core.edges.storage import Arrays, Facts, Stored
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import BEGINNING
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.frozen import storable

from .bridge import Bridge, bridged
from .gaps import BRIDGED
from .gyro import Gyro, rotation_of

# A rotation by fewer radians has no axis, only rounding errors.
_NOTHING = 1e-200


class _Stretch(NamedTuple):
    """
    The gyroscope's measurement between two poses; see ``AidedHistory``.

    :ivar place: the position at the beginning; ``way``: from there to that at the end.
    :ivar start: R0 times the inverse of the gyroscope's orientation at the beginning.
    :ivar axis: of r, the remaining error at the end, in the child's axes; ``half``: |r| / 2.
    """

    begin: int
    end: int
    place: Vector3
    way: Vector3
    start: Quaternion
    axis: Vector3
    half: float


@storable('aided')
class AidedHistory(DynamicHistory):
    """
    Poses, and a gyroscope that measures the rotation between them where it has samples.

    R(t) = R0 dR(t) Exp(u r). dR is the rotation by the gyroscope since the previous pose, u the
    elapsed fraction of the time, and r = Log(dR(t1)^-1 R0^-1 R1) the remaining error at the
    next pose. So the rotation agrees exactly with both poses. A gap of the measurements between
    the poses is bridged. Translations are interpolated linearly, as elsewhere.

    :ivar gyro: the orientations by the gyroscope.
    """

    __slots__ = ('gyro', '_stretch', '_bridge')

    def clear(self) -> None:
        """Remove all samples, including those of the gyroscope."""
        super().clear()
        self.gyro = Gyro(self.cache_time)
        self._forget()

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Take many samples; see ``MovingHistory.extend``."""
        super().extend(stamps, poses)
        self._forget()

    def set_poses(self, poses: Array) -> None:
        """Replace the poses (n, 7) of all n samples in the window."""
        super().set_poses(poses)
        self._forget()

    def _insert_between(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        super()._insert_between(stamp, parent, pose)
        self._forget()

    def _forget(self) -> None:
        # The last stretch used, and the last bridge of a gap.
        self._stretch: _Stretch | None = None
        self._bridge: Bridge | None = None

    def take_rates(self, stamps: Stamps, rates: Array, max_gap: int | None,
                   saturation: float) -> int:
        """Take samples of the gyroscope; see ``Gyro.extend``."""
        self._forget()
        return self.gyro.extend(stamps, rates, max_gap, saturation)

    def copy(self) -> 'AidedHistory':
        """Return an independent history with the same samples."""
        twin = super().copy()
        twin.gyro = self.gyro.copy()
        return twin

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the samples in the window to arrays."""
        return super().frozen(arrays) | {'gyro': self.gyro.frozen(arrays)}

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> 'AidedHistory':
        """Return the frozen data; it uses the memory in place, and nothing can be added."""
        history = super().thawed(child, stored)
        history.gyro = Gyro.thawed(stored.part('gyro'))
        return history

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the pose at a stamp; see the class docstring.

        :raises ExtrapolationException: the stamp is outside the stored span, or the edge had
            ended then. The gyroscope's samples after the last pose have no effect.
        """
        stretch = self._stretch
        if (stretch is None or not stretch.begin < stamp < stretch.end
                or stretch.begin < self._horizon):
            stretch = self._stretch_at(stamp)
            if stretch is None:
                return self._unmeasured(stamp)
        begin, end, (x, y, z), (dx, dy, dz), start, (ax, ay, az), half = stretch
        ratio = (stamp - begin) / (end - begin)
        turned = so3.multiply(start, self.gyro.orientations.sample(stamp)[3:])
        sine = sin(ratio * half)
        return (x + ratio * dx, y + ratio * dy, z + ratio * dz, *so3.multiply(
            turned, (sine * ax, sine * ay, sine * az, cos(ratio * half))))

    def _unmeasured(self, stamp: int) -> PoseTuple:
        """Return the pose at a sample, on a bridge, or where nothing was measured."""
        bridge = self._bridge_at(stamp)
        if bridge is None:
            return super().sample(stamp)
        begin, end, (x, y, z), (dx, dy, dz), *_ = bridge
        ratio = (stamp - begin) / (end - begin)
        return (x + ratio * dx, y + ratio * dy, z + ratio * dz,
                *bridge.rotation(stamp, self.gyro.orientations))

    def _stretch_at(self, stamp: int) -> _Stretch | None:
        """Return the stretch around a stamp; None at a sample, or if it was not measured."""
        index = self._between(stamp)
        self._stretch = None if index is None else self._measured(index)
        return self._stretch

    def _between(self, stamp: int) -> int | None:
        """Return the index of the sample before a stamp; None if the pose is not interpolated."""
        index = self._index_at(stamp)
        if (index is None or stamp == self._stamps[index]
                or self._parents and self._parents[index] != self._parents[index + 1]):
            return None
        return index

    def _measured(self, index: int) -> _Stretch | None:
        """Return the stretch from a sample to the next; None if it was not fully measured."""
        begin, end = self._stamps[index], self._stamps[index + 1]
        whole = self.gyro.turn(begin, end)
        if whole is None:
            return None
        ax, ay, az, aqx, aqy, aqz, aqw, bx, by, bz, bqx, bqy, bqz, bqw = unpack_pair(
            self._poses, index * POSE_BYTES)
        first, last = (aqx, aqy, aqz, aqw), (bqx, bqy, bqz, bqw)
        rest = so3.log(so3.multiply(so3.conjugate(so3.multiply(first, whole)), last))
        angle = math.hypot(*rest)
        scale = 1.0 / angle if angle > _NOTHING else 0.0
        start = so3.multiply(first, so3.conjugate(
            rotation_of(self.gyro.orientations.sample(begin))))
        return _Stretch(begin, end, (ax, ay, az), (bx - ax, by - ay, bz - az), start,
                        (scale * rest[0], scale * rest[1], scale * rest[2]), 0.5 * angle)

    def _bridge_at(self, stamp: int) -> Bridge | None:
        """Return the bridge around a stamp that no stretch contains; None if there is none."""
        bridge = self._bridge
        if (bridge is None or not bridge.begin < stamp < bridge.end
                or bridge.begin < self._horizon or bridge.latest != self.latest_stamp):
            index = self._between(stamp)
            bridge = self._bridge = None if index is None else self._bridge_from(index)
        return bridge

    def _bridge_from(self, index: int) -> Bridge | None:
        """Return the bridge from a sample to the next; None if nothing was measured there."""
        # The gap does not extend over samples if these may have another parent.
        first, last = (self._first(), len(self._stamps) - 1) if self._parents is None else (
            index, index + 1)
        return bridged(self._stamps, self._pose_of, self.gyro, index, first, last)

    def _pose_of(self, index: int) -> PoseTuple:
        return unpack_pose(self._poses, index * POSE_BYTES)

    def _bridges(self, first: int, last: int) -> list[tuple[int, Bridge]]:
        """Return the begin of each interval in which a gap was bridged, and the bridge."""
        indices: set[int] = set()
        for begin, end in self.gyro.gaps(first, last):
            near, far = (self._index_at(max(first, min(last, stamp))) for stamp in (begin, end))
            if near is not None and far is not None:
                # Nothing was measured between these, if there are others.
                indices |= {near, far} if end - begin > BRIDGED else {*range(near, far + 1)}
        bridges = []
        for index in sorted(indices):
            if (index + 1 < len(self._stamps) and self._stamps[index] < self._stamps[index + 1]
                    and self._between(self._stamps[index] + 1) == index
                    and self._measured(index) is None):
                bridge = self._bridge_from(index)
                if bridge is not None:
                    bridges.append((bridge.begin, bridge))
        return bridges

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        stamps, poses = self.copy_between(first, last)
        known = self.gyro.orientations
        if known.oldest_stamp is None or known.latest_stamp is None:
            return InterpolatedTrack(stamps, poses)
        begin, end = (max(known.oldest_stamp, min(known.latest_stamp, int(stamp)))
                      for stamp in stamps[[0, -1]])
        return AidedTrack(stamps, poses, InterpolatedTrack(*known.copy_between(begin, end)),
                          self.gyro.holes(), self._bridges(int(stamps[0]), int(stamps[-1])))

    def closing(self, begin: int, end: int, stamps: Stamps) -> tuple[Array, Array] | None:
        """
        Return the arguments of ``covariances.between_rows`` for a stretch between two poses.

        :return: the remaining error r at the next pose, in the parent's axes, (3,), and the
            rotations of the gyroscope back from there, R0 dR(t) dR(t1)^-1 R0^-1, (N, 3, 3). If a
            gap was bridged, the error is zero, and the matrices are those of ``Bridge.effects``
            by the part of the time. None if nothing was measured.
        """
        whole = self.gyro.turn(begin, end)
        if whole is None:
            return self._bridged_closing(begin, end, stamps)
        first, last = rotation_of(self.sample(begin)), rotation_of(self.sample(end))
        rest = so3.log(so3.multiply(so3.conjugate(so3.multiply(first, whole)), last))
        orientations = self.gyro.orientations
        known = orientations.track(begin, end).at(np.clip(stamps, begin, end))
        start = so3.multiply(first, so3.conjugate(rotation_of(orientations.sample(begin))))
        back = so3.conjugate(so3.multiply(first, whole))
        turned = so3.multiply_many(so3.multiply_many(np.array(start), _rotations(known)),
                                   np.array(back))
        return np.array(so3.rotate(last, rest)), so3.as_matrix_many(turned)

    def _bridged_closing(self, begin: int, end: int,
                         stamps: Stamps) -> tuple[Array, Array] | None:
        """Return ``closing`` of two successive poses with a gap."""
        bridge = self._bridge_at((begin + end) // 2)
        if bridge is None or (bridge.begin, bridge.end) != (begin, end):
            return None
        parts = (np.clip(stamps, begin, end) - begin)[:, None, None] / (end - begin)
        return np.zeros(3), np.where(parts > 0.0, bridge.effects(stamps) / np.where(
            parts > 0.0, parts, 1.0), np.eye(3))


class AidedTrack(InterpolatedTrack):
    """
    Samples of an edge, and of the gyroscope that measures the rotation between them.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    :param gyro: the orientations by the gyroscope.
    :param holes: the intervals without measurements; see ``Gyro.holes``.
    :param bridges: the begin of each interval in which a gap was bridged, and the bridge.
    """

    def __init__(self, knots: Stamps, poses: Array, gyro: InterpolatedTrack,
                 holes: Stamps, bridges: list[tuple[int, Bridge]]) -> None:
        super().__init__(knots, poses)
        self._gyro, self._holes, self._bridges = gyro, holes, dict(bridges)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps."""
        poses = np.array(super().at(stamps, since))
        before, after = self._around(stamps)
        begins, ends = self.knots[before], self.knots[after]
        aided = ((begins < ends) & (begins >= self._gyro.knots[0])
                 & (ends <= self._gyro.knots[-1]))
        hole_begins, hole_ends = self._holes
        aided &= hole_begins[np.minimum(np.searchsorted(hole_ends, begins, side='right'),
                                        len(hole_ends) - 1)] >= ends
        passed = np.asarray(stamps - begins, dtype=float)
        if since is not None:
            passed = passed + since
        whole = passed.astype(np.int64)
        now = _rotations(self._gyro.at(begins + whole, passed - whole))
        rotations = _aided(
            _rotations(self._gyro.at(begins)), _rotations(self._gyro.at(ends)), now,
            _rotations(self._poses.take(before, axis=1)),
            _rotations(self._poses.take(after, axis=1)), passed / np.maximum(ends - begins, 1))
        poses[3:] = np.where(aided, np.moveaxis(rotations, -1, 0), poses[3:])
        if self._bridges:
            begins = np.where(passed > 0.0, begins, BEGINNING)
            for begin in self._bridges.keys() & set(np.unique(begins).tolist()):
                here = begins == begin
                poses[3:, here] = self._bridges[begin].rotations(passed[here], now[here]).T
        return poses

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return infinity: between two poses it may rotate in any way."""
        return math.inf, math.inf


def _rotations(poses: Array) -> Array:
    """Return the quaternions (..., 4) of poses (7, ...)."""
    return np.moveaxis(poses[3:], 0, -1)


def _aided(gyro_begin: Array, gyro_end: Array, gyro_now: Array, first: Array, last: Array,
           ratio: Array) -> Array:
    """Return the rotations (..., 4) of ``AidedHistory`` from orientations (..., 4)."""
    back = so3.conjugate_many(gyro_begin)
    gone, whole = so3.multiply_many(back, gyro_now), so3.multiply_many(back, gyro_end)
    left = so3.log_many(so3.multiply_many(
        so3.conjugate_many(so3.multiply_many(first, whole)), last))
    return so3.multiply_many(so3.multiply_many(first, gone),
                             so3.exp_many(ratio[..., None] * left))


def aided(history: History | None, child: str, cache_time: int) -> AidedHistory:
    """
    Return an edge's history as an aided one: itself, or a new one with its samples.

    A kind of history that has more than samples has a method ``aided()``, which keeps the rest.

    :param history: None if the edge has no history yet.
    :raises InvalidArgumentException: an edge that is not interpolated between samples.
    """
    if history is None:
        return AidedHistory(child, cache_time)
    if isinstance(history, AidedHistory):
        return history
    own: Callable[[], AidedHistory] | None = getattr(history, 'aided', None)
    if own is not None:
        return own()
    if not isinstance(history, DynamicHistory) or isinstance(history, HeldHistory):
        what = 'is static' if history.is_static else 'is not interpolated between samples'
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}: a gyroscope cannot aid it. Pass the '
            'child of the moving edge that the gyroscope rotates with, such as base_link of '
            'odom -> base_link')
    return history.copied_into(AidedHistory(child, cache_time, history.authority))


def turn_of(history: History, begin: int, end: int) -> Quaternion | None:
    """Return the rotation of an edge's child by its gyroscope; None if not fully measured."""
    return history.gyro.turn(begin, end) if isinstance(history, AidedHistory) else None


def gyro_until(history: History) -> int | None:
    """Return the newest stamp of an edge's gyroscope; None without samples or gyroscope."""
    return history.gyro.orientations.latest_stamp if isinstance(history, AidedHistory) else None
