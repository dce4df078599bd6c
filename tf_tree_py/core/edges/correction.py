"""
The correction of one edge over time: what its samples are moved by, and since when.

A function of the stamp that goes smoothly from each correction to the next. What it was
before the newest sample never changes, so no correction changes an answer.
"""

from bisect import bisect_right, insort
import math
from typing import NamedTuple

import numpy as np

from ..geometry import se3, so3
from ..geometry.blend import AT_REST, Blend, blend_to, Limits, Rates
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array, Vector3
from ..times import Stamps


class Measured(NamedTuple):
    """The stamp that a correction was seen at, and the correction."""

    stamp: int
    motion: PoseTuple


class Correction:
    """
    What moves the samples of an edge: C(t) @ parent_T_child, by the sample's stamp t.

    :ivar parent: of the edge that it corrects; the child may change its parent.
    :ivar measured: every correction, sorted by the stamp that it was seen at.
    """

    __slots__ = ('parent', 'measured', '_blends', '_begins')

    def __init__(self, parent: str, since: int) -> None:
        """
        Begin with none.

        :param since: where the first may begin, nanoseconds.
        """
        self.parent = parent
        self.measured: list[Measured] = []
        self._blends = [Blend(since, since, se3.IDENTITY, se3.IDENTITY, AT_REST, Rates())]
        self._begins = [since]

    @property
    def blend(self) -> Blend:
        """Return the newest one, which lasts, or is over."""
        return self._blends[-1]

    def at(self, stamp: int) -> PoseTuple:
        """Return the correction of a sample."""
        index = bisect_right(self._begins, stamp) - 1
        return self._blends[max(index, 0)].at(stamp)

    def at_many(self, stamps: Stamps) -> Array:
        """Return the corrections (N, 7) of samples."""
        which = np.maximum(np.searchsorted(self._begins, stamps, side='right') - 1, 0)
        motions = np.empty((len(stamps), 7))
        for index in np.unique(which).tolist():
            chosen = which == index
            motions[chosen] = self._blends[index].at_many(stamps[chosen])
        return motions

    def absorb(self, measured: Measured, begin: int, about: Vector3, limits: Limits,
               oldest: int) -> Blend:
        """
        Go over to another correction, from the present value and rate.

        A pivot that is within reach stays, so that its bound does.

        :param begin: no earlier than the newest sample.
        :param about: the child's origin at the beginning, before any correction.
        :param oldest: what is older is forgotten.
        """
        blend = self.blend
        if begin < blend.end and math.dist(about, blend.about) <= limits.reach:
            about = blend.about
        self._begin(blend_to(measured.motion, begin, self.at(begin),
                             blend.rates_at(begin, about), about, limits), oldest)
        insort(self.measured, measured, key=lambda one: one.stamp)
        return self.blend

    def change_source(self, begin: int, first: PoseTuple, about: Vector3, limits: Limits,
                      oldest: int) -> Blend:
        """
        Go over to the samples of another source, as they are.

        :param first: what moves these to where the edge is at the beginning.
        :param about: where the source has the child then.
        """
        # As fast as before is what lies at one place, whoever says where that is.
        blend = self.blend
        place = se3.apply(se3.inverse(blend.at(begin)), se3.apply(first, about))
        self._begin(blend_to(se3.IDENTITY, begin, first, blend.rates_at(begin, place), about,
                             limits), oldest)
        self.measured.clear()
        return self.blend

    def _begin(self, blend: Blend, oldest: int) -> None:
        """Let a blend take the place of what was to come."""
        while self._begins and self._begins[-1] >= blend.begin:
            del self._begins[-1], self._blends[-1]
        self._begins.append(blend.begin)
        self._blends.append(blend)
        expired = max(bisect_right(self._begins, oldest) - 1, 0)
        del self._begins[:expired], self._blends[:expired]

    def pending(self, stamps: Stamps, poses: Array) -> Array:
        """
        Return what is still to be corrected of corrected poses.

        :param stamps: (N,)
        :param poses: (N, 7)
        :return: (N, 6) of translation and rotation, as ``geometry.covariances`` has errors.
        """
        motions = self.at_many(stamps)
        last = np.array([blend.last for blend in self._blends])
        which = np.maximum(np.searchsorted(self._begins, stamps, side='right') - 1, 0)
        left = se3.compose_many(last[which], se3.inverse_many(motions))
        return np.concatenate([
            se3.apply_many(left, poses[:, :3]) - poses[:, :3], so3.log_many(left[:, 3:])], axis=1)

    def smoothed(self, stamps: Stamps, poses: Array) -> Array:
        """
        Return poses as all corrections together have them, each at the stamp it was seen at.

        Between two corrections a pose lies between what both make of it; before the first
        and after the last that one holds.

        :param stamps: (N,)
        :param poses: (N, 7) corrected ones.
        """
        return self.with_all(
            stamps, se3.compose_many(se3.inverse_many(self.at_many(stamps)), poses))

    def with_all(self, stamps: Stamps, raw: Array) -> Array:
        """Return poses that were never corrected as ``smoothed`` has them."""
        if not self.measured:
            return raw
        knots = np.array([one.stamp for one in self.measured])
        motions = np.array([one.motion for one in self.measured])
        after = np.searchsorted(knots, stamps, side='right')
        before = np.maximum(after - 1, 0)
        after = np.minimum(np.where(after == 0, 0, after), len(knots) - 1)
        ratio = np.where(before < after, (stamps - knots[before]) / np.maximum(
            knots[after] - knots[before], 1), 0.0)
        return se3.interpolate_many(se3.compose_many(motions[before], raw),
                                    se3.compose_many(motions[after], raw), ratio)

    def copy(self) -> 'Correction':
        """Return one of its own."""
        twin = Correction(self.parent, self._begins[0])
        twin.measured = list(self.measured)
        twin._blends, twin._begins = list(self._blends), list(self._begins)
        return twin
