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
An offset that fades away over time without a jump, with bounded rates.

An offset is a translation d and a rotation Q: a thing is d away from where it belongs, and
turned by Q. Both are multiplied by 1 - (10 x^3 - 15 x^4 + 6 x^5), with x from 0 to 1, which
begins and ends without speed and acceleration (Flash, Hogan, J. Neuroscience 5(7), 1985).
Where the offset changes already at the beginning, its rate times x - 6 x^3 + 8 x^4 - 3 x^5
is added. That polynomial begins at 0 with the slope 1, and ends at 0 without a slope.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from .se3 import IDENTITY, left_jacobian_many, PoseTuple
from .so3 import Array, Vector3
from ..errors import InvalidArgumentException
from ..geometry import so3
from ..stamp import FOREVER, NANOSECONDS_PER_SECOND
from ..times import Stamps

# The greatest slope of the quintic s. A fade that begins with a rate is longer, so that both parts
# together are never faster than the greater of that rate and the limit: max of s' / (1 - |h'|),
# with h the other polynomial.
_PEAK = 1.875
_PEAK_MOVING = 3.65
# Some years before the last stamp: there floats of nanoseconds are a microsecond apart.
_LAST = 0.99 * FOREVER


class Rates(NamedTuple):
    """How fast an offset changes: metres and radians a second, in the parent's axes."""

    velocity: Vector3 = (0.0, 0.0, 0.0)
    turning: Vector3 = (0.0, 0.0, 0.0)


class Limits(NamedTuple):
    """
    How fast an offset may fade, and how long it takes at least.

    :ivar over: nanoseconds.
    :ivar max_speed: metres a second, of every point up to ``reach`` metres away.
    :ivar max_turn_rate: radians a second.
    """

    over: int
    max_speed: float
    max_turn_rate: float
    reach: float


class Fade(NamedTuple):
    """
    An offset that becomes none between two stamps.

    :ivar begin: nanoseconds; up to here it is ``offset``.
    :ivar end: nanoseconds; from here on there is none.
    :ivar rates: how fast it changes at the beginning.
    """

    begin: int
    end: int
    offset: PoseTuple
    rates: Rates

    def at_many(self, stamps: Stamps) -> Array:
        """Return the offsets (N, 7) at stamps (N,)."""
        x = self._part(stamps)
        d, vector = self._way(1.0 - _gone(x), -_gone(x), self._seconds * _carried(x))
        return np.concatenate(
            [d, so3.multiply_many(so3.exp_many(vector), np.array(self.offset[3:]))], axis=1)

    def at(self, stamp: int) -> PoseTuple:
        """Return the offset at a stamp."""
        if stamp >= self.end:
            return IDENTITY
        x = max(0.0, (stamp - self.begin) / (self.end - self.begin))
        gone, carried = _gone(x), self._seconds * _carried(x)
        dx, dy, dz, *q = self.offset
        rotation = (q[0], q[1], q[2], q[3])
        tx, ty, tz = so3.log(rotation)
        (vx, vy, vz), (wx, wy, wz) = self.rates
        turn = so3.exp((carried * wx - gone * tx, carried * wy - gone * ty,
                        carried * wz - gone * tz))
        left = 1.0 - gone
        return (left * dx + carried * vx, left * dy + carried * vy, left * dz + carried * vz,
                *so3.multiply(turn, rotation))

    def rates_at(self, stamp: int) -> Rates:
        """Return how fast it changes at a stamp."""
        if stamp >= self.end:
            return Rates()
        x = self._part(np.array([stamp]))
        vector = self._way(0.0, -_gone(x), self._seconds * _carried(x))[1]
        gone = -_gone_rate(x) / self._seconds
        velocity, rate = self._way(gone, gone, _carried_rate(x))
        turning = left_jacobian_many(vector) @ rate[..., None]
        return Rates(_vector(velocity[0]), _vector(turning[0, :, 0]))

    @property
    def _seconds(self) -> float:
        return (self.end - self.begin) / NANOSECONDS_PER_SECOND

    def _part(self, stamps: Stamps) -> Array:
        """Return how much of the fade has passed, 0 to 1, (N, 1)."""
        part = np.clip((stamps - self.begin) / max(self.end - self.begin, 1), 0.0, 1.0)
        return np.where(stamps >= self.end, 1.0, part)[:, None]

    def _way(self, translation: Any, turn: Any, carried: Any) -> tuple[Array, Array]:
        """Return parts of the translation and of the rotation vector, with what the rates add."""
        d, q = np.array(self.offset[:3]), self.offset[3:]
        return (translation * d + carried * np.array(self.rates.velocity),
                turn * np.array(so3.log(q)) + carried * np.array(self.rates.turning))


def fade(offset: PoseTuple, rates: Rates, begin: int, limits: Limits) -> Fade:
    """
    Return the shortest fade within limits that begins at a stamp with an offset and rates.

    :raises InvalidArgumentException: it would end after the last stamp of 64 bits.
    """
    way, turn = math.hypot(*offset[:3]), math.hypot(*so3.log(offset[3:]))
    peak = _PEAK if rates == Rates() else _PEAK_MOVING
    seconds = peak * max((way + limits.reach * turn) / limits.max_speed,
                         turn / limits.max_turn_rate)
    span = max(limits.over, seconds * NANOSECONDS_PER_SECOND)
    if not begin + span < _LAST:
        raise InvalidArgumentException(
            f'To go {way:g} m and turn by {turn:g} rad within these limits takes {span:g} ns, and '
            'stamps have 64 bits: allow a shorter over, a higher max_speed or max_turn_rate')
    return Fade(begin, begin + math.ceil(span), offset, rates)


def _vector(array: Array) -> Vector3:
    x, y, z = array.tolist()
    return (x, y, z)


# --- the two polynomials and their rates, by x from 0 to 1

def _gone(x: Any) -> Any:
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _gone_rate(x: Any) -> Any:
    return 30.0 * x**2 * (1.0 - x)**2


def _carried(x: Any) -> Any:
    return x - x**3 * (6.0 - 8.0 * x + 3.0 * x**2)


def _carried_rate(x: Any) -> Any:
    return 1.0 - x**2 * (18.0 - 32.0 * x + 15.0 * x**2)
