# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Estimating map -> odom from poses in the map that are late, infrequent and sometimes wrong.

AMCL, a tag or a splat gives the pose of a camera in the map, and the odometry gives its pose
in odom at the same stamp. Both together give the pose of odom in the map. That changes slowly,
so the delay of the pose does not matter. Each new value is gated, and fused with the
previous estimate, in the convention of ``uncertainty.covariances``.
"""

from bisect import bisect_right
import math
import operator
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import BEGINNING, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Indices

from .blend import BlendLimits
from .correction import Correction
from .stage import ORIGIN
from ..uncertainty.covariances import carried, checked_covariance

# One of a thousand good poses exceeds this squared Mahalanobis distance: chi^2 with 6 degrees of
# freedom, and with the 3 of a plane.
GATE, GATE_IN_PLANE = 22.46, 16.27
# How many consecutive sightings that agree with each other, but not with the estimate, replace it;
# and how many that agree make the first estimate.
_RIVALS, _FIRST = 4, 2
# The minimum variance, because some covariances contain zeros: the squares of 0.01 mm and of
# 0.01 mrad.
_FLOOR = 1e-10
# How long published values are kept; and the limits of a jump.
_KEPT = from_seconds(60.0)
_AT_ONCE = BlendLimits(0, math.inf, math.inf, 0.0)
# How many sightings are kept to recognise repeated ones, which are no new evidence.
_REMEMBERED = 4096
# How many accepted sightings are kept to fuse one that arrives later and is older.
_RECENT = 64
# The coordinates of a plane among x, y, z and rotation about x, y, z.
_IN_PLANE = np.array([0, 1, 5])
_ALL = np.arange(6)


class Sighting(NamedTuple):
    """
    The poses of a frame in the map and in odom, at one stamp.

    :ivar covariance: (6, 6) of ``map_T_frame``.
    :ivar odom_covariance: (6, 6) of ``odom_T_frame``; zeros if unknown.
    """

    stamp: int
    map_T_frame: PoseTuple
    covariance: Array
    odom_T_frame: PoseTuple
    odom_covariance: Array


class AnchorEstimate(NamedTuple):
    """
    The estimate of map -> odom.

    :ivar covariance: (6, 6), of ``map_T_odom`` as a rigid motion about ``place``; in the plane,
        z, roll and pitch are certain.
    :ivar place: the last position of the frame in the map, where the estimate is most certain.
    :ivar odom_place: its position in odom at that time.
    :ivar agreed: how many sightings agreed.
    """

    stamp: int
    map_T_odom: PoseTuple
    covariance: Array
    place: Vector3
    odom_place: Vector3
    agreed: int


class _Fused(NamedTuple):
    """An accepted sighting, and the estimate before it."""

    sighting: Sighting
    before: AnchorEstimate


class Verdict(NamedTuple):
    """
    The result of a sighting.

    :ivar accepted: whether it agrees with the estimate, or was the last one needed to make a
        new estimate.
    :ivar distance: its squared Mahalanobis distance from the estimate; None if there was none.
    :ivar repeated: whether it was received before; a repeated sighting is no new evidence.
    :ivar relocalised: whether the estimate of earlier sightings was replaced.
    :ivar jump: the metres and radians by which the published edge jumps to the estimate; None
        if it blends.
    """

    accepted: bool
    distance: float | None
    repeated: bool = False
    relocalised: bool = False
    jump: tuple[float, float] | None = None


class Remaining(NamedTuple):
    """
    How far the published edge is from the estimate.

    :ivar distance: of the frame, metres.
    :ivar angle: radians.
    :ivar seconds: until the blend ends, if the estimate stays the same and the frame stands.
    """

    distance: float
    angle: float
    seconds: float


class Anchor:
    """
    Estimates map -> odom, and computes the edge to publish, which never jumps.

    :ivar gate: the squared Mahalanobis distance beyond which a sighting is refused.
    :ivar held: the estimate from the accepted sightings; None before the first two that agree.
    """

    def __init__(self, limits: BlendLimits, drift: tuple[float, float] = (0.05, 0.02),
                 gate: float | None = None, *, drift_by_way: tuple[float, float] = (0.0, 0.0),
                 planar: bool = False,
                 jump_above: tuple[float, float] = (math.inf, math.inf)) -> None:
        """
        Start without an estimate.

        :param limits: the limits of the blend of the published edge to the estimate.
        :param drift: the drift of the odometry: metres and radians per square root of a second.
        :param gate: the squared Mahalanobis distance beyond which a sighting is refused; None:
            the one that refuses one of a thousand good sightings.
        :param drift_by_way: the drift by distance: metres and radians per square root of a
            metre between two sightings.
        :param planar: fuse x, y and yaw only; z, roll and pitch stay those of the odometry.
        :param jump_above: the metres and radians from the estimate beyond which the published
            edge jumps to it.
        """
        self._limits, self._planar, self._jump_above = limits, planar, jump_above
        self.gate = (GATE_IN_PLANE if planar else GATE) if gate is None else gate
        self._drift, self._drift_by_way = (
            np.diag(np.square([one[0]] * 3 + [one[1]] * 3)) for one in (drift, drift_by_way))
        self.begin_anew()

    def begin_anew(self) -> None:
        """Remove all data, because time has restarted."""
        self.held: AnchorEstimate | None = None
        self._alternative: AnchorEstimate | None = None
        # In the order of their stamps.
        self._recent: list[_Fused] = []
        self._correction = Correction()
        self._published: int | None = None
        # After this published stamp the edge jumps, which was reported.
        self._jumps_after: int | None = None
        self._oldest = BEGINNING
        # The newest known position of the frame in odom.
        self._odom_place: Vector3 | None = None
        self._taken: dict[tuple[int, PoseTuple], None] = {}

    # --- receiving

    def update(self, sighting: Sighting) -> Verdict:
        """
        Update by a sighting; if it is accepted, the published edge blends to the new estimate.

        :raises InvalidArgumentException: a pose that is not finite, or an invalid covariance.
        """
        sighting = _checked(sighting)
        if self._is_repeated(sighting):
            return Verdict(False, None, repeated=True)
        before, distance = self.held, None
        if before is not None:
            later = bisect_right(self._recent, sighting.stamp, key=lambda one: one.sighting.stamp)
            start = self._recent[later].before if later < len(self._recent) else before
            fused, distance = self._fused(start, sighting)
            if distance <= self.gate:
                return Verdict(True, distance, jump=self._hold(
                    self._with_later(_Fused(sighting, start), fused, later), sighting))
        rival = self._rival(sighting)
        if rival.agreed < (_FIRST if before is None else _RIVALS):
            return Verdict(False, distance)
        self._recent.clear()
        return Verdict(True, distance, relocalised=before is not None,
                       jump=self._hold(rival, sighting))

    def _is_repeated(self, sighting: Sighting) -> bool:
        """Return whether the same sighting was received before, and remember it."""
        key = (sighting.stamp, Pose._make(sighting.map_T_frame))
        if key in self._taken:
            return True
        self._taken[key] = None
        if len(self._taken) > _REMEMBERED:
            del self._taken[next(iter(self._taken))]
        return False

    def _rival(self, sighting: Sighting) -> AnchorEstimate:
        """Keep a sighting that the estimate does not explain; return what such ones agree on."""
        rival = _estimate_of(sighting, self._planar)
        if self._alternative is not None:
            fused, distance = self._fused(self._alternative, sighting)
            rival = fused if distance <= self.gate else rival
        self._alternative = rival
        return rival

    def _with_later(self, one: _Fused, fused: AnchorEstimate, later: int) -> AnchorEstimate:
        """Fuse the recent sightings from a place on again, after one that is older than they."""
        again = [one]
        for sighting, _ in self._recent[later:]:
            again.append(_Fused(sighting, fused))
            fused, _ = self._fused(fused, sighting)
        self._recent[later:] = again
        del self._recent[:-_RECENT]
        return fused

    def _fused(self, estimate: AnchorEstimate, sighting: Sighting) -> tuple[AnchorEstimate, float]:
        """Fuse both by a Kalman filter about the frame; also return their distance."""
        expected = se3.compose(estimate.map_T_odom, sighting.odom_T_frame)
        lever = np.subtract(expected[:3], estimate.place)
        passed = abs(sighting.stamp - estimate.stamp) / NANOSECONDS_PER_SECOND
        way = math.dist(sighting.odom_T_frame[:3], estimate.odom_place)
        before = carried(np.eye(3), lever, estimate.covariance) + _spread_over(
            lever, passed * self._drift + way * self._drift_by_way)
        turn = so3.multiply(sighting.map_T_frame[3:], so3.conjugate(expected[3:]))
        off = np.array((*np.subtract(sighting.map_T_frame[:3], expected[:3]), *so3.log(turn)))
        noise = _noise(sighting, estimate.map_T_odom)
        change, after, distance = _filtered(before, noise, off,
                                            _IN_PLANE if self._planar else _ALL)
        x, y, z, *vector = change.tolist()
        place = (expected[0] + x, expected[1] + y, expected[2] + z)
        there = (*place, *so3.multiply(so3.exp((vector[0], vector[1], vector[2])), expected[3:]))
        return AnchorEstimate(
            max(sighting.stamp, estimate.stamp),
            se3.compose(there, se3.inverse(sighting.odom_T_frame)), after, place,
            sighting.odom_T_frame[:3], estimate.agreed + 1), distance

    def _hold(self, estimate: AnchorEstimate, sighting: Sighting) -> tuple[float, float] | None:
        """Make an estimate the goal of the published edge; return how far that jumps to it."""
        self.held, self._alternative = estimate, None
        if self._published is None:
            return None
        place = self._odom_place or sighting.odom_T_frame[:3]
        far = _between(self._now(), estimate.map_T_odom, place)
        jumps = any(map(operator.gt, far, self._jump_above))
        self._blend(estimate.map_T_odom, place, _AT_ONCE if jumps else self._limits)
        was_reported = self._jumps_after == self._published
        self._jumps_after = self._published if jumps else None
        return far if jumps and not was_reported else None

    # --- publishing

    def publish(self, stamp: int, odom_T_frame: PoseTuple | None) -> Pose | None:
        """
        Return ``map_T_odom`` for a stamp, to be published; None without an estimate.

        The value for a stamp that was published never changes: a later correction begins
        after the newest of these stamps.

        :param odom_T_frame: the newest pose of the frame in odom. The edge rotates about the
            frame, so the frame keeps to ``max_speed`` wherever it drives: the blend moves it by
            at most that, and ``max_turn_rate`` times the distance that it drives between two
            calls. None: the pose is unknown. Then the edge rotates about the last known one, and
            a frame that has driven on may exceed ``max_speed``: the blend moves it by up to
            ``max_turn_rate`` times its distance from there, too.
        :raises InvalidArgumentException: the stamp is older than the first published one, or
            than the newest by more than a minute.
        """
        if self.held is None:
            return None
        if self._published is None:
            self._published = self._oldest = stamp
            self._correction.begin_blend(
                self.held.map_T_odom, stamp - 1, self.held.map_T_odom, se3.IDENTITY, ORIGIN,
                self._limits, BEGINNING)
        if stamp < max(self._oldest, self._published - _KEPT):
            raise InvalidArgumentException(
                f'Invalid argument stamp {stamp}: map -> odom is known from '
                f'{max(self._oldest, self._published - _KEPT)} on')
        if odom_T_frame is not None:
            self._follow(odom_T_frame[:3])
        self._published = max(self._published, stamp)
        return Pose._make(self._correction.moved(stamp, se3.IDENTITY))

    def _follow(self, odom_place: Vector3) -> None:
        """Move the point that a blend rotates about with the frame."""
        assert self._published is not None
        self._odom_place, stage = odom_place, self._correction.stage
        if self._published < stage.end and odom_place != stage.about:
            self._blend(stage.motion, odom_place, self._limits)

    def _blend(self, map_T_odom: PoseTuple, odom_place: Vector3, limits: BlendLimits) -> None:
        assert self._published is not None
        self._correction.correct(map_T_odom, self._published, self._now(), odom_place, limits,
                                 self._published - _KEPT)

    def _now(self) -> PoseTuple:
        """Return the newest published value."""
        assert self._published is not None
        return self._correction.moved(self._published, se3.IDENTITY)

    @property
    def remaining(self) -> Remaining:
        """Return how far the newest published value is from the estimate."""
        stage = self._correction.stage
        if self._published is None or self._published >= stage.end:
            return Remaining(0.0, 0.0, 0.0)
        seconds = (stage.end - max(self._published, stage.begin)) / NANOSECONDS_PER_SECOND
        return Remaining(*_between(self._now(), stage.motion, stage.about), seconds)


def _between(a: PoseTuple, b: PoseTuple, place: Vector3) -> tuple[float, float]:
    """Return how far apart a place, metres, and the rotation, radians, are in two poses."""
    return (math.dist(se3.apply(a, place), se3.apply(b, place)),
            se3.distance(a, b)[1])


def _checked(sighting: Sighting) -> Sighting:
    if not np.isfinite((*sighting.map_T_frame, *sighting.odom_T_frame)).all():
        raise InvalidArgumentException('the poses of a sighting must be finite')
    return sighting._replace(covariance=checked_covariance(sighting.covariance),
                             odom_covariance=checked_covariance(sighting.odom_covariance))


def _spread_over(lever: Array, drift: Array) -> Array:
    """
    Return what a drift adds while the frame moves on a line, the lever.

    A rotation also moves the frame by its lever from where it happened to the end. That is
    quadratic in the lever, so Simpson's rule is its exact mean over the line.
    """
    middle, end = (carried(np.eye(3), part * lever, drift) for part in (0.5, 1.0))
    return np.asarray((drift + 4.0 * middle + end) / 6.0)


def _filtered(before: Array, noise: Array, off: Array,
              seen: Indices) -> tuple[Array, Array, float]:
    """
    Return the step of a Kalman filter that measures some coordinates; the others are certain.

    :return: the change (6,), the covariance after it, and the squared Mahalanobis distance.
    """
    block = np.ix_(seen, seen)
    spread = before[block] + noise[block]
    gain = np.linalg.solve(spread, before[block]).T
    change = np.zeros(6)
    change[seen] = gain @ off[seen]
    rest = np.eye(len(seen)) - gain
    after = np.zeros((6, 6))
    # Joseph's form is valid for any gain, and stays positive.
    after[block] = rest @ before[block] @ rest.T + gain @ noise[block] @ gain.T
    return change, after, float(off[seen] @ np.linalg.solve(spread, off[seen]))


def _estimate_of(sighting: Sighting, planar: bool) -> AnchorEstimate:
    """Return the estimate of one sighting alone."""
    map_T_odom = se3.compose(sighting.map_T_frame, se3.inverse(sighting.odom_T_frame))
    if planar:
        level = so3.from_rpy(0.0, 0.0, so3.as_rpy(map_T_odom[3:])[2])
        x, y, _ = so3.rotate(level, sighting.odom_T_frame[:3])
        map_T_odom = (sighting.map_T_frame[0] - x, sighting.map_T_frame[1] - y, 0.0, *level)
    return AnchorEstimate(sighting.stamp, map_T_odom, _noise(sighting, map_T_odom),
                          sighting.map_T_frame[:3], sighting.odom_T_frame[:3], 1)


def _noise(sighting: Sighting, map_T_odom: PoseTuple) -> Array:
    """Return the sum of the covariances of both poses of a sighting, in the map's axes."""
    axes = np.array(so3.as_matrix(map_T_odom[3:]))
    return np.asarray(sighting.covariance + _FLOOR * np.eye(6)
                      + carried(axes, np.zeros(3), sighting.odom_covariance))
