# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
An edge aided by a gyroscope, which measures the rotation between two poses.

The error of the gyroscope, which is mostly its bias, is distributed evenly over the time from
one pose to the next. If the gyroscope did not measure a part of that time, the error is that
of the gap: see ``bridge``.
"""

import math
from math import cos, sin
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.interpolation import Interpolation, is_linear
from tf_tree_py.core.edges.packed import PackedSamples, POSE_BYTES, unpack_pair
from tf_tree_py.core.edges.protocol import EdgeTrack, History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.tracks import InterpolatedTrack
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import BEGINNING, from_seconds
from tf_tree_py.core.times import Stamps
from tf_tree_py.files.edges import Arrays, Facts, load_interpolation, save_interpolation, Saved

from .bridge import Bridge, bridged
from .gaps import BRIDGED
from .gyro import Gyro, rotation_of

# A rotation by fewer radians has no axis, only rounding errors.
_NOTHING = 1e-200


class _Stretch(NamedTuple):
    """
    The gyroscope's measurement between two poses; see ``GyroAided``.

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


class GyroAided(Interpolation):
    """
    Poses, and a gyroscope that measures the rotation between them where it has samples.

    R(t) = R0 dR(t) Exp(u r). dR is the rotation by the gyroscope since the previous pose, u the
    elapsed fraction of the time, and r = Log(dR(t1)^-1 R0^-1 R1) the remaining error at the
    next pose. So the rotation agrees exactly with both poses. A gap of the measurements between
    the poses is bridged. Translations are those of the interpolation beneath it.

    :ivar gyro: the orientations by the gyroscope; those after the newest pose have no effect.
    :ivar base: the interpolation where nothing was measured.
    """

    name = 'aided'

    def __init__(self, gyro: Gyro, base: Interpolation) -> None:
        self.gyro, self.base = gyro, base
        self.holds_for = base.holds_for
        self._moves_on_a_line = is_linear(base)
        self.forget()

    def forget(self) -> None:
        """Remove what was computed from samples, because some of them have changed."""
        # The last stretch used, and the last bridge of a gap.
        self._stretch: _Stretch | None = None
        self._bridge: Bridge | None = None
        self.base.forget()

    def clear(self) -> None:
        """Remove the samples of the gyroscope."""
        self.gyro = Gyro(self.gyro.orientations.cache_time)
        self.base.clear()
        self.forget()

    def insert_rates(self, stamps: Stamps, rates: Array, max_gap: int | None,
                     saturation: float) -> int:
        """Insert samples of the gyroscope; see ``Gyro.extend``."""
        self.forget()
        return self.gyro.extend(stamps, rates, max_gap, saturation)

    def followed_by(self, other: Interpolation) -> 'GyroAided':
        """Return the same gyroscope with another interpolation where nothing was measured."""
        return GyroAided(self.gyro, other)

    # --- copies and files

    def copy(self) -> 'GyroAided':
        """Return an independent copy."""
        return GyroAided(self.gyro.copy(), self.base.copy())

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the samples in the window to arrays."""
        gyro = self.gyro.save(arrays)
        return {'gyro': gyro, 'base': save_interpolation(self.base, arrays)}

    @classmethod
    def load(cls, saved: Saved) -> 'GyroAided':
        """Return the saved data; it uses the memory in place, and nothing can be added."""
        gyro = Gyro.load(saved.part('gyro'))
        return cls(gyro, load_interpolation(saved.part('base')))

    # --- one pose

    def between(self, samples: PackedSamples, index: int, stamp: int) -> PoseTuple:
        """Return the pose at a stamp between two samples; see the class docstring."""
        stretch = self._stretch
        begin, end = samples.stamps[index], samples.stamps[index + 1]
        if stretch is None or stretch.begin != begin or stretch.end != end:
            stretch = self._stretch = self._measured(samples, index)
            if stretch is None:
                return self._unmeasured(samples, index, stamp)
        _, _, place, way, start, (ax, ay, az), half = stretch
        ratio = (stamp - begin) / (end - begin)
        turned = so3.multiply(start, self.gyro.orientations.sample(stamp)[3:])
        sine = sin(ratio * half)
        rotation = so3.multiply(turned, (sine * ax, sine * ay, sine * az, cos(ratio * half)))
        if not self._moves_on_a_line:
            return (*self.base.pose(samples, index, stamp)[:3], *rotation)
        (x, y, z), (dx, dy, dz) = place, way
        return (x + ratio * dx, y + ratio * dy, z + ratio * dz, *rotation)

    pose = between  # it needs no check

    def _unmeasured(self, samples: PackedSamples, index: int, stamp: int) -> PoseTuple:
        """Return the pose on a bridge, or where nothing was measured."""
        bridge = self._bridge_at(samples, index)
        place = self.base.pose(samples, index, stamp)
        if bridge is None:
            return place
        return (*place[:3], *bridge.rotation(stamp, self.gyro.orientations))

    def _measured(self, samples: PackedSamples, index: int) -> _Stretch | None:
        """Return the stretch from a sample to the next; None if it was not fully measured."""
        begin, end = samples.stamps[index], samples.stamps[index + 1]
        whole = self.gyro.turn(begin, end)
        if whole is None:
            return None
        ax, ay, az, aqx, aqy, aqz, aqw, bx, by, bz, bqx, bqy, bqz, bqw = unpack_pair(
            samples.poses, index * POSE_BYTES)
        first, last = (aqx, aqy, aqz, aqw), (bqx, bqy, bqz, bqw)
        rest = so3.log(so3.multiply(so3.conjugate(so3.multiply(first, whole)), last))
        angle = math.hypot(*rest)
        scale = 1.0 / angle if angle > _NOTHING else 0.0
        start = so3.multiply(first, so3.conjugate(
            rotation_of(self.gyro.orientations.sample(begin))))
        return _Stretch(begin, end, (ax, ay, az), (bx - ax, by - ay, bz - az), start,
                        (scale * rest[0], scale * rest[1], scale * rest[2]), 0.5 * angle)

    def _bridge_at(self, samples: PackedSamples, index: int) -> Bridge | None:
        """Return the bridge from a sample to the next; None if nothing was measured there."""
        bridge = self._bridge
        if (bridge is None or bridge.begin != samples.stamps[index]
                or bridge.end != samples.stamps[index + 1]
                or bridge.latest != samples.newest_stamp):
            bridge = self._bridge = self._bridge_from(samples, index)
        return bridge

    def _bridge_from(self, samples: PackedSamples, index: int) -> Bridge | None:
        # The gap does not extend over samples if these may have another parent.
        first, last = (index, index + 1) if samples.parents is not None else (
            samples.first(), len(samples.stamps) - 1)
        return bridged(samples, self.gyro, index, first, last)

    # --- many poses, and covariances

    def track(self, samples: PackedSamples, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        base, known = self.base.track(samples, first, last), self.gyro.orientations
        if known.oldest_stamp is None or known.newest_stamp is None:
            return base
        stamps, poses = samples.copy_between(first, last)
        begin, end = (max(known.oldest_stamp, min(known.newest_stamp, int(stamp)))
                      for stamp in stamps[[0, -1]])
        return AidedTrack(stamps, poses, base,
                          InterpolatedTrack(*known.copy_between(begin, end)), self.gyro.holes(),
                          self._bridges(samples, int(stamps[0]), int(stamps[-1])))

    def _bridges(self, samples: PackedSamples, first: int,
                 last: int) -> list[tuple[int, Bridge]]:
        """Return the begin of each interval in which a gap was bridged, and the bridge."""
        indices: set[int] = set()
        for begin, end in self.gyro.gaps(first, last):
            near, far = (samples.index_at(max(first, min(last, stamp)))
                         for stamp in (begin, end))
            if near is not None and far is not None:
                # Nothing was measured between these, if there are others.
                indices |= {near, far} if end - begin > BRIDGED else {*range(near, far + 1)}
        bridges = []
        for index in sorted(indices):
            if samples.joins(index) and self._measured(samples, index) is None:
                bridge = self._bridge_from(samples, index)
                if bridge is not None:
                    bridges.append((bridge.begin, bridge))
        return bridges

    def closing(self, history: Samples, begin: int, end: int,
                stamps: Stamps) -> tuple[Array, Array] | None:
        """
        Return the arguments of ``covariances.between_rows`` for a stretch between two poses.

        :return: the remaining error r at the next pose, in the parent's axes, (3,), and the
            rotations of the gyroscope back from there, R0 dR(t) dR(t1)^-1 R0^-1, (N, 3, 3). If a
            gap was bridged, the error is zero, and the matrices are those of ``Bridge.effects``
            by the part of the time. None if nothing was measured.
        """
        whole = self.gyro.turn(begin, end)
        if whole is None:
            return self._bridged_closing(history, begin, end, stamps)
        first, last = rotation_of(history.sample(begin)), rotation_of(history.sample(end))
        rest = so3.log(so3.multiply(so3.conjugate(so3.multiply(first, whole)), last))
        orientations = self.gyro.orientations
        known = orientations.track(begin, end).at(np.clip(stamps, begin, end))
        start = so3.multiply(first, so3.conjugate(rotation_of(orientations.sample(begin))))
        back = so3.conjugate(so3.multiply(first, whole))
        turned = so3.multiply_many(so3.multiply_many(np.array(start), _rotations(known)),
                                   np.array(back))
        return np.array(so3.rotate(last, rest)), so3.as_matrix_many(turned)

    def _bridged_closing(self, samples: PackedSamples, begin: int, end: int,
                         stamps: Stamps) -> tuple[Array, Array] | None:
        """Return ``closing`` of two successive poses with a gap."""
        index = samples.index_at((begin + end) // 2)
        if index is None or not samples.joins(index):
            return None
        bridge = self._bridge_at(samples, index)
        if bridge is None or (bridge.begin, bridge.end) != (begin, end):
            return None
        parts = (np.clip(stamps, begin, end) - begin)[:, None, None] / (end - begin)
        return np.zeros(3), np.where(parts > 0.0, bridge.effects(stamps) / np.where(
            parts > 0.0, parts, 1.0), np.eye(3))


class AidedTrack:
    """
    Samples of an edge, and of the gyroscope that measures the rotation between them.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    :param base: the edge where nothing was measured.
    :param gyro: the orientations by the gyroscope.
    :param holes: the intervals without measurements; see ``Gyro.holes``.
    :param bridges: the begin of each interval in which a gap was bridged, and the bridge.
    """

    def __init__(self, knots: Stamps, poses: Array, base: EdgeTrack, gyro: InterpolatedTrack,
                 holes: Stamps, bridges: list[tuple[int, Bridge]]) -> None:
        self.knots, self._quaternions = knots, poses[:, 3:]
        self._base = base
        self._gyro, self._holes, self._bridges = gyro, holes, dict(bridges)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps."""
        poses = np.array(self._base.at(stamps, since))
        after = self.knots.searchsorted(stamps, side='right')
        before, after = after - 1, np.minimum(after, len(self.knots) - 1)
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
            self._quaternions[before], self._quaternions[after],
            passed / np.maximum(ends - begins, 1))
        poses[3:] = np.where(aided, np.moveaxis(rotations, -1, 0), poses[3:])
        if self._bridges:
            begins = np.where(passed > 0.0, begins, BEGINNING)
            for begin in self._bridges.keys() & set(np.unique(begins).tolist()):
                here = begins == begin
                poses[3:, here] = self._bridges[begin].rotations(passed[here], now[here]).T
        return poses

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""
        return self._base.reach

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return infinity: between two poses it may rotate in any way."""
        return math.inf, math.inf


def _rotations(poses: Array) -> Array:
    """Return the quaternions (..., 4) of poses (7, ...)."""
    return np.moveaxis(poses[3:], 0, -1)


def _aided(gyro_begin: Array, gyro_end: Array, gyro_now: Array, first: Array, last: Array,
           ratio: Array) -> Array:
    """Return the rotations (..., 4) of ``GyroAided`` from orientations (..., 4)."""
    back = so3.conjugate_many(gyro_begin)
    gone, whole = so3.multiply_many(back, gyro_now), so3.multiply_many(back, gyro_end)
    left = so3.log_many(so3.multiply_many(
        so3.conjugate_many(so3.multiply_many(first, whole)), last))
    return so3.multiply_many(so3.multiply_many(first, gone),
                             so3.exp_many(ratio[..., None] * left))


def aided(history: History | None, child: str, cache_time: int) -> tuple[Samples, GyroAided]:
    """
    Return an edge's history, new if it has none, and the gyroscope that aids it from now on.

    :param history: None if the edge has no history yet.
    :raises InvalidArgumentException: the edge has no samples between which it could help.
    """
    if history is None:
        history = Samples(child, cache_time)
    if not isinstance(history, Samples):
        what = 'is static' if history.is_static else 'is not interpolated between samples'
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}: a gyroscope cannot aid it. Pass the '
            'child of the moving edge that the gyroscope rotates with, such as base_link of '
            'odom -> base_link')
    aid = history.interpolation
    if not isinstance(aid, GyroAided):
        aid = GyroAided(Gyro(history.cache_time), aid)
        history.interpolate_by(aid)
    return history, aid


def gyro_of(history: History) -> Gyro | None:
    """Return the gyroscope of an edge; None if it has none."""
    aid = history.interpolation if isinstance(history, Samples) else None
    return aid.gyro if isinstance(aid, GyroAided) else None


LATEST_RATES = from_seconds(1.0)
"""What is learnt from poses does not wait for angular velocities that arrive later than this."""


def note_rates(history: Samples, known_until: int | None, oldest: int) -> None:
    """
    Note that angular velocities change poses that something may have been learnt from.

    :param known_until: ``gyro_until`` before they were inserted.
    :param oldest: the oldest stamp of them.
    """
    newest = history.newest_stamp
    if newest is None:
        return
    if known_until is None:
        history.late = BEGINNING
    elif min(known_until, oldest) < newest - LATEST_RATES:
        history.late = min(history.late, oldest)


def turn_of(history: History, begin: int, end: int) -> Quaternion | None:
    """Return the rotation of an edge's child by its gyroscope; None if not fully measured."""
    gyro = gyro_of(history)
    return None if gyro is None else gyro.turn(begin, end)


def gyro_until(history: History) -> int | None:
    """Return the newest stamp of an edge's gyroscope; None without samples or gyroscope."""
    gyro = gyro_of(history)
    return None if gyro is None else gyro.orientations.newest_stamp
