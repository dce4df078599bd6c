# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The samples of a gyroscope, integrated to an orientation over time.

This is similar to the preintegration of Forster et al., "On-Manifold Preintegration for
Real-Time Visual-Inertial Odometry", IEEE T-RO 33(1), 2017.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
import math

import numpy as np
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import BEGINNING, FOREVER, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps
from tf_tree_py.files.edges import Arrays, Facts, load_samples, save_samples, Saved

# The frame that orientations are relative to: the child, as it was at the first sample.
_FIRST_SAMPLE = 'start'
# More than this number of usual periods without a sample is a hole.
_GAP_PERIODS = 5.0
# The same in nanoseconds, before a period is known.
_FIRST_GAP = from_seconds(0.2)
# The weight of the newest period in the average.
_PERIOD_WEIGHT = 0.2


class Gyro:
    """
    The orientation over time, integrated from the rates of a gyroscope.

    It is relative to the orientation at the first sample. Between two samples the child rotates
    at the mean of the two rates. Where samples are missing or saturated, the rotation is
    unknown: this is a hole, which ``bridge`` crosses. A sample takes 64 bytes; they are kept as
    long as the poses.
    """

    __slots__ = ('orientations', '_rate', '_holes', '_period', '_was_saturated')

    def __init__(self, cache_time: int) -> None:
        self.orientations = Samples('', cache_time)
        self._rate = (0.0, 0.0, 0.0)
        # The beginning and end of each hole, sorted.
        self._holes: list[tuple[int, int]] = []
        # The average time between two samples, nanoseconds; None before the second sample.
        self._period: float | None = None
        self._was_saturated = False

    def extend(self, stamps: Stamps, rates: Array, max_gap: int | None = None,
               saturation: float = math.inf) -> int:
        """
        Add the samples that are newer than all before; return their number.

        :param stamps: (N,) sorted.
        :param rates: (N, 3) radians per second, in the child's axes.
        :param max_gap: the longest time between two samples without a hole, nanoseconds;
            None: five average periods.
        :param saturation: the rate about one axis, radians per second, at and above which the
            gyroscope saturates.
        """
        saturated = (np.abs(rates) >= saturation).any(axis=1).tolist()
        known = self.orientations
        before = known.newest_stamp
        taken = 0
        for stamp, rate, is_saturated in zip(stamps.tolist(), rates.tolist(), saturated,
                                             strict=True):
            if before is not None and stamp <= before:
                continue
            pose = se3.IDENTITY
            if before is not None:
                pose = self._turned(rate, (stamp - before) / NANOSECONDS_PER_SECOND)
                if (self._is_gap(stamp - before, max_gap) or is_saturated
                        or self._was_saturated):
                    self._add_hole(before, stamp)
            known.insert(stamp, _FIRST_SAMPLE, pose)
            before, self._rate, self._was_saturated = stamp, rate, is_saturated
            taken += 1
        return taken

    def _is_gap(self, passed: int, max_gap: int | None) -> bool:
        """Return whether samples are missing; if not, add the period to the average."""
        known = self._period
        usual = _FIRST_GAP if known is None else _GAP_PERIODS * known
        is_gap = passed > (usual if max_gap is None else max_gap)
        if known is None:
            self._period = float(passed)
        elif not is_gap:
            self._period = known + _PERIOD_WEIGHT * (passed - known)
        return is_gap

    def _add_hole(self, begin: int, end: int) -> None:
        if self._holes and self._holes[-1][1] == begin:
            begin = self._holes.pop()[0]
        self._holes.append((begin, end))
        oldest = end - self.orientations.cache_time
        while self._holes[0][1] < oldest:
            del self._holes[0]

    def has_hole(self, begin: int, end: int) -> bool:
        """Return whether the rotation is unknown somewhere between two stamps."""
        after = bisect_right(self._holes, begin, key=lambda hole: hole[1])
        return after < len(self._holes) and self._holes[after][0] < end

    def holes(self) -> Stamps:
        """Return the beginnings and ends of all holes, (2, n), and of one beyond all stamps."""
        return np.array([*self._holes, (FOREVER - 1, FOREVER - 1)], dtype=np.int64).T

    def gaps(self, first: int, last: int) -> list[tuple[int, int]]:
        """
        Return the gaps that are partly between two stamps, in order; those that touch are one.

        The times before the first sample and after the last are gaps, too.
        """
        known = self.orientations
        if known.oldest_stamp is None or known.newest_stamp is None:
            return [(BEGINNING, FOREVER)]
        begin, end = BEGINNING, known.oldest_stamp
        found = []
        here = bisect_right(self._holes, first, key=lambda hole: hole[1])
        for hole in (*self._holes[here:bisect_left(self._holes, last, here, key=_begin_of)],
                     (known.newest_stamp, FOREVER)):
            if hole[0] > end:
                found.append((begin, end))
                begin = hole[0]
            end = max(end, hole[1])
        return [gap for gap in (*found, (begin, end)) if gap[0] < last and first < gap[1]]

    def rate_before(self, stamp: int) -> Vector3 | None:
        """
        Return the rate just before a sample, radians per second; None if it was not measured.

        It is extrapolated linearly from the mean rates of the two periods before.
        """
        return self._rate_beside(stamp, self._previous)

    def rate_after(self, stamp: int) -> Vector3 | None:
        """Return the rate just after a sample; see ``rate_before``."""
        return self._rate_beside(stamp, self._next)

    def _rate_beside(self, stamp: int, neighbour: Callable[[int], int | None]) -> Vector3 | None:
        near = neighbour(stamp)
        if near is None:
            return None
        rate, far = self._mean_rate(near, stamp), neighbour(near)
        return rate if far is None else _extrapolated(
            self._mean_rate(far, near), abs(near - far), rate, abs(stamp - near))

    def _previous(self, stamp: int) -> int | None:
        """Return the sample before another one; None if there is a hole in between."""
        oldest = self.orientations.oldest_stamp
        if oldest is None or stamp <= oldest:
            return None
        before = int(self.orientations.copy_between(stamp - 1, stamp - 1)[0][0])
        return None if self.has_hole(before, stamp) else before

    def _next(self, stamp: int) -> int | None:
        """Return the sample after another one; None if there is a hole in between."""
        after = self.orientations.next_stamp(stamp)
        return None if after == FOREVER or self.has_hole(stamp, after) else after

    def _mean_rate(self, begin: int, end: int) -> Vector3:
        """Return the mean rate between two samples, in either order."""
        known, rate = self.orientations, NANOSECONDS_PER_SECOND / (end - begin)
        x, y, z = so3.log(so3.multiply(so3.conjugate(rotation_of(known.sample(begin))),
                                       rotation_of(known.sample(end))))
        return rate * x, rate * y, rate * z

    def _turned(self, rate: Sequence[float], seconds: float) -> PoseTuple:
        known = self.orientations
        assert known.newest_stamp is not None
        *_, qx, qy, qz, qw = known.sample(known.newest_stamp)
        x, y, z = (0.5 * seconds * (old + new) for old, new in zip(self._rate, rate, strict=True))
        turned = so3.multiply((qx, qy, qz, qw), so3.exp((x, y, z)))
        return (0.0, 0.0, 0.0, *so3.normalize(turned))

    def turn(self, begin: int, end: int) -> Quaternion | None:
        """Return the rotation from one stamp to another, in the child's axes; None if unknown."""
        known = self.orientations
        if not _covers(known, begin, end) or self.has_hole(begin, end):
            return None
        first, last = known.sample(begin), known.sample(end)
        return so3.multiply(so3.conjugate(rotation_of(first)), rotation_of(last))

    def copy(self) -> 'Gyro':
        """Return a copy with the same samples."""
        twin = Gyro(self.orientations.cache_time)
        twin.orientations, twin._rate = self.orientations.copy(), self._rate
        twin._holes, twin._period = self._holes[:], self._period
        twin._was_saturated = self._was_saturated
        return twin

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the samples in the window to arrays."""
        # Without the last rate: only adding samples needs it, and a loaded tree takes none.
        return save_samples(self.orientations, arrays) | {'holes': list(map(list, self._holes))}

    @classmethod
    def load(cls, saved: Saved) -> 'Gyro':
        """Return the saved gyroscope; it uses the memory in place and takes no samples."""
        gyro = cls(saved.cache_time)
        gyro.orientations = load_samples(Samples, '', saved)
        gyro._holes = [(begin, end) for begin, end in saved.rows('holes', 2, 0)]
        if gyro._holes != sorted(gyro._holes):
            raise ValueError("'holes' are not in order")
        return gyro


def _begin_of(gap: tuple[int, int]) -> int:
    return gap[0]


def _extrapolated(far: Vector3, far_span: int, near: Vector3, near_span: int) -> Vector3:
    """Return the rate at the end of two periods from their mean rates, the far one first."""
    factor = near_span / (near_span + far_span)
    x, y, z = (one + factor * (one - other) for one, other in zip(near, far, strict=True))
    return x, y, z


def _covers(history: Samples, begin: int, end: int) -> bool:
    """Return whether there are samples from one stamp to another."""
    oldest, newest = history.oldest_stamp, history.newest_stamp
    return oldest is not None and newest is not None and oldest <= begin and end <= newest


def rotation_of(pose: PoseTuple) -> Quaternion:
    """Return the quaternion of a pose."""
    return (pose[3], pose[4], pose[5], pose[6])
