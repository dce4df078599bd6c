# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reducing an offset to zero from any initial rate, with a bounded rate and acceleration.

An offset has six components: a translation and a rotation vector. Along the line to zero the
motion is time-optimal: it accelerates, cruises, and brakes (the double integrator of optimal
control; Kröger and Wahl, "Online Trajectory Generation", IEEE T-RO 26(1), 2010). A rate
perpendicular to that line is stopped and reversed by the same law. So a change of the offset
during a blend only changes the goal: value and rate stay continuous.
"""

from collections.abc import Callable
import math
from typing import NamedTuple

from tf_tree_py import screws
from tf_tree_py.core.geometry.so3 import Number, Six

_Vector6 = Six[float]

ZERO: _Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

# A blend with a limited rate takes at least this many seconds, because acceleration takes time.
_LEAST_SECONDS = 0.1
# The weight of an unlimited part of an offset relative to a limited one.
_WEIGHT_OF_UNLIMITED = 1e-6
# A vector with a smaller norm is zero.
_NOTHING = 1e-18
# How much harder than usual it may brake if the goal has moved nearer.
_BRAKE = 4.0
# An excess of a rate by less than this part of its limit is a rounding error.
_ABOVE = 1e-12
# The largest part of the limit that a perpendicular rate may have, to be reversed during the
# motion along the line.
_MOST_ASIDE = math.sqrt(0.5)


class BlendLimits(NamedTuple):
    """
    The maximum rate of a blend, and its minimum duration.

    :ivar over: the minimum duration from rest, nanoseconds.
    :ivar max_speed: metres per second, for every point up to ``reach`` metres away.
    :ivar max_turn_rate: radians per second.
    """

    over: int
    max_speed: float
    max_turn_rate: float
    reach: float


class Scale(NamedTuple):
    """
    The limits combined to one: the weighted norm of a rate is at most ``most``.

    :ivar translation: the weight of metres.
    :ivar rotation: the weight of radians.
    :ivar seconds: the minimum duration of a blend, from rest to rest.
    """

    translation: float
    rotation: float
    most: float
    seconds: float

    def norm(self, vector: _Vector6) -> float:
        """Return the weighted norm."""
        return math.hypot(
            self.translation * math.hypot(vector[0], vector[1], vector[2]),
            self.rotation * math.hypot(vector[3], vector[4], vector[5]))

    def product(self, a: _Vector6, b: _Vector6) -> float:
        """Return the weighted scalar product."""
        return (self.translation**2 * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
                + self.rotation**2 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]))


def scale_of(limits: BlendLimits) -> Scale:
    """Return the combined limits, such that all points within reach keep to the speed limit."""
    speed, turn_rate, seconds = limits.max_speed, limits.max_turn_rate, limits.over * 1e-9
    if limits.reach > 0.0:
        # (a, b) with |a|^2 / A^2 + |b|^2 / B^2 <= 1 has |a| + |b| <= sqrt(A^2 + B^2).
        turn_rate = min(turn_rate, _MOST_ASIDE * speed / limits.reach)
        if speed < math.inf:
            speed = math.sqrt(speed**2 - (limits.reach * turn_rate)**2)
    if speed == turn_rate == math.inf:
        return Scale(1.0, 1.0, math.inf, seconds)
    known = 1.0 / min(speed, turn_rate)
    return Scale(1.0 / speed if speed < math.inf else _WEIGHT_OF_UNLIMITED * known,
                 1.0 / turn_rate if turn_rate < math.inf else _WEIGHT_OF_UNLIMITED * known,
                 1.0, max(seconds, _LEAST_SECONDS))


class Course(NamedTuple):
    """
    A motion along one line to rest at its end.

    After ``wait`` seconds, the rate changes from ``rate`` to ``cruise_rate`` in ``first``
    seconds, stays constant for ``cruise`` seconds, and decreases to zero in ``last`` seconds.

    :ivar line: the change of the offset per unit of distance along the line.
    """

    line: _Vector6
    wait: float
    rate: float
    first: float
    cruise_rate: float
    cruise: float
    last: float

    @property
    def seconds(self) -> float:
        """Return the duration."""
        return self.wait + self.first + self.cruise + self.last

    @property
    def acceleration(self) -> float:
        """Return the acceleration at the beginning, without its sign."""
        return abs(self.cruise_rate - self.rate) / self.first if self.first else 0.0


STANDING = Course(ZERO, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def way(seconds: Number, course: Six[Number], lesser: Callable[[Number, Number], Number],
        greater: Callable[[Number, Number | float], Number]) -> Number:
    """
    Return the distance of a course along its line after some seconds.

    :param course: a ``Course`` without its line; or the columns of many.
    :param lesser: ``min``, or ``np.minimum`` for arrays; ``greater``: ``max``, or ``np.maximum``.
    """
    wait, rate, first, cruise_rate, cruise, last = course
    passed = seconds - wait
    early = lesser(greater(passed, 0.0), first)
    late = lesser(greater(passed - first - cruise, 0.0), last)
    # The distance on a ramp is the elapsed time times the mean of the rates at both of its ends.
    return (early * (rate + 0.5 * (cruise_rate - rate) * early / greater(first, 1e-300))
            + cruise_rate * lesser(greater(passed - first, 0.0), cruise)
            + cruise_rate * late * (1.0 - 0.5 * late / greater(last, 1e-300)))


def rate_of(seconds: float, course: Course) -> float:
    """Return the rate of a course along its line after some seconds."""
    passed = seconds - course.wait
    if passed < course.first:
        if passed < 0.0:
            return 0.0
        return course.rate + (course.cruise_rate - course.rate) * passed / course.first
    left = course.seconds - seconds
    if left >= course.last:
        return course.cruise_rate
    return course.cruise_rate * left / course.last if left > 0.0 else 0.0


def _fastest(offset: _Vector6, distance: float, rate: float, most: float, acceleration: float,
             wait: float = 0.0) -> Course:
    """
    Return the fastest course that reduces an offset to zero, from any initial rate.

    :param offset: its norm is the distance; if that is 0, the rate. The course moves along its
        negative direction.
    :param most: the highest rate after the first ramp.
    """
    if distance < _NOTHING > abs(rate):
        return STANDING
    half = 0.5 * rate * rate
    ahead = acceleration * distance >= math.copysign(half, rate)
    peak = min(most, math.sqrt(max(half + (acceleration if ahead else -acceleration) * distance,
                                   0.0)))
    if not ahead:
        peak = -peak
    first, last = abs(peak - rate) / acceleration, abs(peak) / acceleration
    rest = distance - 0.5 * (rate + peak) * first - 0.5 * peak * last
    cruise = max(rest / peak, 0.0) if peak else 0.0
    line = screws.times(-1.0 / (distance if distance >= _NOTHING else rate), offset)
    return Course(line, wait, rate, first, peak, cruise, last)


class Plan(NamedTuple):
    """
    The motion of an offset to zero, along a line and perpendicular to it.

    :ivar acceleration: of the weighted norm, per second^2.
    """

    main: Course
    aside: Course
    scale: Scale
    acceleration: float

    @property
    def seconds(self) -> float:
        """Return the duration."""
        return max(self.main.seconds, self.aside.seconds)

    def rates_at(self, seconds: float) -> _Vector6:
        """Return the rate of the offset after some seconds."""
        rate = rate_of(seconds, self.main)
        if self.aside is STANDING:
            return screws.times(rate, self.main.line)
        return screws.plus(screws.times(rate, self.main.line), rate_of(seconds, self.aside),
                           self.aside.line)


AT_REST = Plan(STANDING, STANDING, Scale(1.0, 1.0, math.inf, 0.0), 0.0)


def planned(offset: _Vector6, rates: _Vector6, scale: Scale, before: Plan) -> Plan:
    """
    Return the plan that takes an offset with given rates to zero.

    :param before: the plan that these rates come from.
    """
    distance, speed = scale.norm(offset), scale.norm(rates)
    if distance < _NOTHING > speed or not scale.seconds:
        return AT_REST
    usual, acceleration = _acceleration(distance, speed, scale, before)
    return Plan(*_courses(offset, rates, scale, acceleration), scale, usual)


def _courses(offset: _Vector6, rates: _Vector6, scale: Scale,
             acceleration: float) -> tuple[Course, Course]:
    distance = scale.norm(offset)
    towards, aside = 0.0, rates
    if distance >= _NOTHING:
        towards = -scale.product(offset, rates) / distance
        aside = screws.plus(rates, towards / distance, offset)
    across = scale.norm(aside)
    if across > _MOST_ASIDE * scale.most:
        return _anew(offset, rates, scale, acceleration)
    most = math.sqrt(scale.most**2 - across**2) if scale.most < math.inf else math.inf
    return (_fastest(offset, distance, towards, most, acceleration),
            _fastest(screws.times(-1.0, aside), 0.0, across, math.inf, acceleration))


def _anew(offset: _Vector6, rates: _Vector6, scale: Scale,
          acceleration: float) -> tuple[Course, Course]:
    """
    Brake on the present line, and begin a new line at the same time.

    The new line accelerates as the old one brakes, so their sum is no faster than the limit.
    The new line begins when the old one is within the limit.
    """
    speed = scale.norm(rates)
    line = screws.times(1.0 / speed, rates)
    braking = Course(line, 0.0, speed, speed / acceleration, 0.0, 0.0, 0.0)
    left = screws.plus(offset, 0.5 * speed / acceleration, rates)
    wait = max(speed - scale.most, 0.0) / acceleration
    return _fastest(left, scale.norm(left), 0.0, scale.most, acceleration, wait), braking


def _acceleration(distance: float, speed: float, scale: Scale,
                  before: Plan) -> tuple[float, float]:
    """
    Return the acceleration for which a motion from rest takes the required time.

    The present rate is converted to the distance that it took to reach it. A motion that brakes
    already continues to brake as hard, so that it stops as planned, although the goal may vary
    slightly.

    :return: that acceleration, and the one allowed for stopping if the goal has moved nearer, or
        for reaching a lower limit in time.
    """
    same = before.scale == scale
    known = (before.acceleration if same else 0.0) or 2.0 * speed / scale.seconds
    whole = distance + (0.5 * speed * speed / known if speed >= _NOTHING else 0.0)
    from_rest = min(4.0 * whole / scale.seconds**2, 2.0 * scale.most / scale.seconds)
    to_stop = 0.5 * speed * speed / distance if distance else math.inf
    usual = max(from_rest, min(_BRAKE * to_stop, known))
    allowed = max(usual, min(to_stop, _BRAKE * usual))
    too_fast = speed - scale.most
    if too_fast > _ABOVE * scale.most:
        allowed = max(allowed, _to_limit(too_fast, scale, before if same else AT_REST))
    return usual, allowed


def _to_limit(too_fast: float, scale: Scale, before: Plan) -> float:
    """
    Return the deceleration that reaches the limit within half of the minimum duration.

    It does not decrease from one plan to the next: the excess does, so a deceleration in
    proportion to it would never reach the limit while new goals keep coming.

    :param before: the plan that the excess comes from; at rest, if its limits were others.
    """
    return max(2.0 * too_fast / scale.seconds,
               before.main.acceleration, before.aside.acceleration)
