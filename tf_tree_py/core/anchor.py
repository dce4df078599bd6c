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
map -> odom out of a relocalisation that comes late, now and then, and is sometimes wrong.

AMCL, a tag or a splat says where a camera was in the map, and the odometry says where it
was at the same stamp. Together they say where odom is in the map. That changes slowly, so
it does not matter that the pose is old. Each new value is gated, and fused with the
estimate so far, in the convention of ``geometry.covariances``.
"""

from typing import NamedTuple

import numpy as np

from .edges.correction import Correction, ORIGIN
from .errors import InvalidArgumentException
from .geometry import se3, so3
from .geometry.blend import Limits
from .geometry.covariances import carried
from .geometry.pose import Pose
from .geometry.se3 import PoseTuple
from .geometry.so3 import Array, Vector3
from .stamp import BEGINNING, from_seconds, NANOSECONDS_PER_SECOND

# Beyond this squared Mahalanobis distance lies one good pose of a thousand: chi^2, 6 degrees.
GATE = 22.46
# This many sightings in a row that agree with each other, but not with the estimate, replace it;
# and this many that agree make the first estimate.
_RIVALS, _FIRST = 4, 2
# The least variance, for covariances that say that something is known exactly: the squares of
# 0.01 mm and of 0.01 mrad.
_FLOOR = 1e-10
# What was published longer ago than this is forgotten.
_KEPT = from_seconds(60.0)


class Sighting(NamedTuple):
    """
    Where a frame was in the map, and where the odometry had it, at one stamp.

    :ivar covariance: (6, 6) of ``map_T_frame``.
    :ivar odom_covariance: (6, 6) of ``odom_T_frame``; zeros where nobody says.
    """

    stamp: int
    map_T_frame: PoseTuple
    covariance: Array
    odom_T_frame: PoseTuple
    odom_covariance: Array


class Estimate(NamedTuple):
    """
    What is held of map -> odom.

    :ivar covariance: (6, 6), of ``map_T_odom`` as a rigid motion about ``place``.
    :ivar place: where the frame was in the map last: there it is known best.
    :ivar agreed: how many sightings agreed.
    """

    stamp: int
    map_T_odom: PoseTuple
    covariance: Array
    place: Vector3
    agreed: int


class Verdict(NamedTuple):
    """
    What became of a sighting.

    :ivar accepted: whether it agrees with the estimate, or was the last one needed to make a
        new estimate.
    :ivar distance: its squared Mahalanobis distance from the estimate; None: there was none.
    """

    accepted: bool
    distance: float | None


class Anchor:
    """
    Holds map -> odom, and says what to publish: an edge that never jumps.

    :ivar held: what the accepted sightings say together; None before the first two that agree.
    """

    def __init__(self, limits: Limits, drift: tuple[float, float] = (0.05, 0.02),
                 gate: float = GATE) -> None:
        """
        Begin with nothing.

        :param limits: how the published edge goes over to what is held.
        :param drift: how the odometry gets lost: metres and radians for the root of a second.
        :param gate: the squared Mahalanobis distance beyond which a sighting is refused.
        """
        self._limits, self._gate = limits, gate
        self._drift = np.diag(np.square([drift[0]] * 3 + [drift[1]] * 3))
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget everything, for another time has begun."""
        self.held: Estimate | None = None
        self._rival: Estimate | None = None
        self._correction = Correction('', BEGINNING)
        self._published: int | None = None

    # --- what comes in

    def take(self, sighting: Sighting) -> Verdict:
        """Take a sighting; if it is accepted, the published edge goes over to the new estimate."""
        if not np.isfinite((*sighting.map_T_frame, *sighting.odom_T_frame)).all():
            raise InvalidArgumentException('a pose that is not finite says nothing')
        if self.held is None:
            return Verdict(self._take_as_rival(sighting, _FIRST), None)
        fused, distance = self._fused(self.held, sighting)
        if distance > self._gate:
            return Verdict(self._take_as_rival(sighting, _RIVALS), distance)
        self._rival = None
        self._hold(fused, sighting)
        return Verdict(True, distance)

    def _take_as_rival(self, sighting: Sighting, needed: int) -> bool:
        """Keep a sighting beside the estimate; return whether it was the last one needed."""
        rival = _estimate_of(sighting)
        if self._rival is not None:
            fused, distance = self._fused(self._rival, sighting)
            rival = fused if distance <= self._gate else rival
        self._rival = rival
        if rival.agreed < needed:
            return False
        self._rival = None
        self._hold(rival, sighting)
        return True

    def _fused(self, estimate: Estimate, sighting: Sighting) -> tuple[Estimate, float]:
        """Fuse both by a Kalman filter about the frame; return that, and how far they disagree."""
        expected = se3.compose(estimate.map_T_odom, sighting.odom_T_frame)
        lever = np.subtract(expected[:3], estimate.place)
        passed = abs(sighting.stamp - estimate.stamp) / NANOSECONDS_PER_SECOND
        before = carried(np.eye(3), lever, estimate.covariance) + passed * self._drift
        turn = so3.multiply(sighting.map_T_frame[3:], so3.conjugate(expected[3:]))
        off = np.array((*np.subtract(sighting.map_T_frame[:3], expected[:3]), *so3.log(turn)))
        spread = before + _noise(sighting, estimate.map_T_odom)
        gain = np.linalg.solve(spread, before).T
        distance = float(off @ np.linalg.solve(spread, off))
        x, y, z, *vector = (gain @ off).tolist()
        place = (expected[0] + x, expected[1] + y, expected[2] + z)
        there = (*place, *so3.multiply(so3.exp((vector[0], vector[1], vector[2])), expected[3:]))
        after = (np.eye(6) - gain) @ before
        return Estimate(
            max(sighting.stamp, estimate.stamp),
            se3.compose(there, se3.inverse(sighting.odom_T_frame)),
            0.5 * (after + after.T), place, estimate.agreed + 1), distance

    def _hold(self, estimate: Estimate, sighting: Sighting) -> None:
        self.held = estimate
        if self._published is None:
            return
        here = self._correction.moved(self._published, se3.IDENTITY)
        self._correction.go_over(
            estimate.map_T_odom, self._published, here, se3.IDENTITY, sighting.odom_T_frame[:3],
            self._limits, self._published - _KEPT)

    # --- what goes out

    def publish(self, stamp: int) -> Pose | None:
        """
        Return ``map_T_odom`` for a stamp, to be published; None while nothing is held.

        The value for a stamp that was published never changes: a later correction begins
        after the newest of these stamps.
        """
        if self.held is None:
            return None
        if self._published is None:
            self._published = stamp
            self._correction.go_over(
                self.held.map_T_odom, stamp - 1, self.held.map_T_odom, se3.IDENTITY, ORIGIN,
                self._limits, BEGINNING)
        self._published = max(self._published, stamp)
        return Pose._make(self._correction.moved(stamp, se3.IDENTITY))


def _estimate_of(sighting: Sighting) -> Estimate:
    """Return the estimate of one sighting alone."""
    map_T_odom = se3.compose(sighting.map_T_frame, se3.inverse(sighting.odom_T_frame))
    return Estimate(sighting.stamp, map_T_odom, _noise(sighting, map_T_odom),
                    sighting.map_T_frame[:3], 1)


def _noise(sighting: Sighting, map_T_odom: PoseTuple) -> Array:
    """Return the covariance of a sighting, with that of both of its poses, in the map's axes."""
    axes = np.array(so3.as_matrix(map_T_odom[3:]))
    return np.asarray(sighting.covariance + _FLOOR * np.eye(6)
                      + carried(axes, np.zeros(3), sighting.odom_covariance))
