"""
From one rigid motion to another without a jump: a quintic over time, with bounded rates.

A point p goes to about + c + Q (p - about). The translation c of the pivot and the rotation
Q are blended apart, so that the pivot's speed and the turn rate are bounded each by itself,
and a point r metres from the pivot gains no more than speed + r times turn rate. Both
follow 10 x^3 - 15 x^4 + 6 x^5, which begins and ends without speed and acceleration (Flash,
Hogan, J. Neuroscience 5(7), 1985); what moves already gets x - 6 x^3 + 8 x^4 - 3 x^5 times
its rate besides, which begins with that rate and ends with none, where it began.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from .se3 import apply, left_jacobian_many, PoseTuple
from .so3 import Array, Vector3
from ..geometry import so3
from ..stamp import NANOSECONDS_PER_SECOND
from ..times import Stamps

# The greatest rate of the quintic; and what a blend is longer by, so that its rate and that of
# what it begins with are never more together than the latter was: max of s' / (1 - |h'|).
_PEAK = 1.875
_PEAK_MOVING = 3.65

AT_REST = (0.0, 0.0, 0.0)


class Rates(NamedTuple):
    """
    How fast a rigid motion changes.

    :ivar velocity: of its pivot, metres a second.
    :ivar turning: radians a second. Both in the parent's axes.
    """

    velocity: Vector3 = AT_REST
    turning: Vector3 = AT_REST


class Limits(NamedTuple):
    """
    How fast a blend may be, and what it takes at least.

    :ivar over: nanoseconds.
    :ivar max_speed: metres a second, of every point up to ``reach`` metres from the pivot.
    :ivar max_turn_rate: radians a second.
    """

    over: int
    max_speed: float
    max_turn_rate: float
    reach: float


class Blend(NamedTuple):
    """
    A rigid motion that goes from one pose to another between two stamps.

    :ivar begin: nanoseconds; up to here it is ``first``.
    :ivar end: nanoseconds; from here on it is ``last``.
    :ivar about: the pivot, before the motion.
    :ivar rates: those at the beginning.
    """

    begin: int
    end: int
    first: PoseTuple
    last: PoseTuple
    about: Vector3
    rates: Rates

    def at(self, stamp: int) -> PoseTuple:
        """Return the motion at a stamp."""
        if stamp >= self.end:
            return self.last
        if stamp <= self.begin:
            return self.first
        x, y, z, qx, qy, qz, qw = self.at_many(np.array([stamp]))[0].tolist()
        return (x, y, z, qx, qy, qz, qw)

    def at_many(self, stamps: Stamps) -> Array:
        """Return the motion (N, 7) at stamps (N,)."""
        x = self._part(stamps)[:, None]
        shift, vector = self._way(_gone(x), self._seconds * _carried(x))
        q = so3.multiply_many(so3.exp_many(vector), np.array(self.first[3:]))
        about = np.array(self.about)
        t = about + shift - so3.rotate_many(q, np.broadcast_to(about, shift.shape))
        poses = np.concatenate([t, q], axis=1)
        poses[stamps <= self.begin] = self.first
        poses[stamps >= self.end] = self.last
        return poses

    def rates_at(self, stamp: int, about: Vector3) -> Rates:
        """Return how fast it changes at a stamp, as a point sees it that the motion moves."""
        x = self._part(np.array([stamp]))[:, None]
        if self.begin == self.end or stamp >= self.end:
            return Rates()
        vector = self._way(_gone(x), self._seconds * _carried(x))[1]
        velocity, rate = self._way(_gone_rate(x) / self._seconds, _carried_rate(x), True)
        turning = (left_jacobian_many(vector) @ rate[..., None])[0, :, 0]
        arm = np.subtract(apply(self.at(stamp), about), apply(self.at(stamp), self.about))
        velocity = velocity[0] + np.cross(turning, arm)
        return Rates(_vector(velocity), _vector(turning))

    @property
    def _seconds(self) -> float:
        return (self.end - self.begin) / NANOSECONDS_PER_SECOND

    def _part(self, stamps: Stamps) -> Array:
        """Return which part of the blend has passed, 0 to 1."""
        return np.clip((stamps - self.begin) / max(self.end - self.begin, 1), 0.0, 1.0)

    def _way(self, gone: Any, carried: Any, rate: bool = False) -> tuple[Array, Array]:
        """Return the pivot's shift and the rotation vector since the beginning, or their rates."""
        first, last = shift(self.first, self.about), shift(self.last, self.about)
        turn = so3.log(so3.multiply(self.last[3:], so3.conjugate(self.first[3:])))
        began = np.zeros(3) if rate else np.array(first)
        return (began + gone * np.subtract(last, first) + carried * np.array(self.rates.velocity),
                gone * np.array(turn) + carried * np.array(self.rates.turning))


def blend_to(last: PoseTuple, begin: int, first: PoseTuple, rates: Rates, about: Vector3,
             limits: Limits) -> Blend:
    """Return the shortest blend from a motion with some rates to another, within limits."""
    way = math.dist(shift(first, about), shift(last, about))
    turn = math.hypot(*so3.log(so3.multiply(last[3:], so3.conjugate(first[3:]))))
    peak = _PEAK if rates == Rates() else _PEAK_MOVING
    seconds = peak * max((way + limits.reach * turn) / limits.max_speed,
                         turn / limits.max_turn_rate)
    span = max(limits.over, math.ceil(seconds * NANOSECONDS_PER_SECOND))
    return Blend(begin, begin + span, first, last, about, rates)


def shift(motion: PoseTuple, about: Vector3) -> Vector3:
    """Return how far a rigid motion moves a point."""
    x, y, z = apply(motion, about)
    return (x - about[0], y - about[1], z - about[2])


def _vector(array: Array) -> Vector3:
    x, y, z = array.tolist()
    return (x, y, z)


# --- the two polynomials and their rates, by x from 0 to 1

def _gone(x: Array) -> Array:
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _gone_rate(x: Array) -> Array:
    return 30.0 * x**2 * (1.0 - x)**2


def _carried(x: Array) -> Array:
    return x - x**3 * (6.0 - 8.0 * x + 3.0 * x**2)


def _carried_rate(x: Array) -> Array:
    return 1.0 - x**2 * (18.0 - 32.0 * x + 15.0 * x**2)
