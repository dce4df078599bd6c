# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Cumulative cubic B-splines on poses: one piece of such a curve, and its derivatives.

A piece depends on four knots, X_0 to X_3, with a parameter u from 0 to 1:
X(u) = X_0 Exp(l_1 d_1) Exp(l_2 d_2) Exp(l_3 d_3), with the steps d_j = Log(X_(j-1)^-1 X_j)
and weights l_j(u) (Lovegrove, Patron-Perez, Sibley, "Spline Fusion", BMVC 2013; the
derivatives: Sommer et al., "Efficient Derivative Computation for Cumulative B-Splines on
Lie Groups", CVPR 2020). It is twice continuously differentiable across pieces.

There are two groups. On ``SPLIT``, which is R^3 x SO(3), the position is an ordinary cubic
spline, separate from the rotation. On ``SE3`` both move together, on screws. An element of
either has seven numbers and a tangent six, as in ``se3``: (v, w), metres and radians. On SPLIT
the v of a tangent is in the parent's axes, on SE3 in the child's.

Every number may be a float or an array: the formulas are valid for both, and a group has
``exp`` for floats and ``exp_many`` for arrays. Times are not used here.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array, Number, Seven, Six, Three

Steps = Iterable[Sequence[Number]]
Rates = tuple[Six[Number], Six[Number]]
# Of floats, also among arrays.
_ZERO: tuple[Any, ...] = (0.0,) * 6


class Group(NamedTuple):
    """
    The functions of a group that a spline needs.

    :ivar name: of the group.
    :ivar compose: the product of two elements.
    :ivar inverse: of an element.
    :ivar exp: from a tangent of floats to an element.
    :ivar exp_many: the same for arrays.
    :ivar log: from an element of floats to a tangent.
    :ivar log_many: the inverse of ``exp_many``.
    :ivar adjoint: transforms a tangent by an element, Ad_X d.
    :ivar bracket: of two tangents, ad_c d.
    :ivar in_childs_axes: converts the first and second derivatives at an element to the twist
        and the acceleration of the origin in the child's axes.
    """

    name: str
    compose: Callable[[Seven[Number], Seven[Number]], Seven[Number]]
    inverse: Callable[[Seven[Number]], Seven[Number]]
    exp: Callable[[Six[float]], Seven[float]]
    exp_many: Callable[[Six[Array]], Seven[Array]]
    log: Callable[[Seven[float]], Six[float]]
    log_many: Callable[[Seven[Array]], Six[Array]]
    adjoint: Callable[[Seven[Number], Six[Number]], Six[Number]]
    bracket: Callable[[Six[Number], Sequence[Number]], Six[Number]]
    in_childs_axes: Callable[[Seven[Number], Six[Number], Six[Number]], Rates[Number]]


# --- the weights


def weights(u: Number) -> Three[Number]:
    """Return the weights of the three steps of a piece."""
    square = u * u
    cube = square * u
    return ((5.0 + 3.0 * u - 3.0 * square + cube) / 6.0,
            (1.0 + 3.0 * u + 3.0 * square - 2.0 * cube) / 6.0, cube / 6.0)


def _weight_rates(u: Number) -> Three[Number]:
    """Return the first derivatives of the weights with respect to u."""
    return 0.5 * (1.0 - u) * (1.0 - u), 0.5 + u - u * u, 0.5 * u * u


def _weight_bends(u: Number) -> Three[Number]:
    """Return the second derivatives of the weights with respect to u."""
    return u - 1.0, 1.0 - 2.0 * u, u


# --- a piece. Tuples are joined by +, because mypy does not know what a star is if a number is
# either a float or an array.


def pose_on(group: Group, first: Seven[float], steps: Steps[float], u: float) -> Seven[float]:
    """
    Return the pose on a piece, for floats.

    :param first: (7,) the first of its four knots.
    :param steps: (3, 6) the tangents from each knot to the next.
    :param u: 0 to 1.
    """
    return _along(group, group.exp, first, steps, u)


def poses_on(group: Group, first: Array, steps: Array, u: Array) -> Array:
    """Return the poses (7, ...) on pieces with first (7, ...), steps (3, 6, ...), u (...)."""
    return np.stack(_along(group, group.exp_many, tuple(first), steps, u))


def _along(group: Group, exp: Callable[[Six[Number]], Seven[Number]], pose: Seven[Number],
           steps: Steps[Number], u: Number) -> Seven[Number]:
    for weight, step in zip(weights(u), steps, strict=True):
        pose = group.compose(pose, exp(screws.times(weight, step)))
    return pose


def rates_on(group: Group, first: Seven[float], steps: Steps[float], u: float) -> Rates[float]:
    """
    Return the twist and the acceleration on a piece, for floats, with respect to u.

    :return: (6,) the velocity of the child's origin and the angular velocity, and (6,) the
        acceleration of that origin and the angular acceleration, all in the child's axes.
    """
    return group.in_childs_axes(pose_on(group, first, steps, u),
                                *_rates(group, group.exp, steps, u))


def rates_on_many(group: Group, first: Array, steps: Array, u: Array) -> tuple[Array, Array]:
    """Return twists and accelerations (6, ...) on pieces; see ``rates_on`` and ``poses_on``."""
    twist, acceleration = group.in_childs_axes(
        tuple(poses_on(group, first, steps, u)), *_rates(group, group.exp_many, steps, u))
    return np.stack(twist), np.stack(acceleration)


def _rates(group: Group, exp: Callable[[Six[Number]], Seven[Number]], steps: Steps[Number],
           u: Number) -> Rates[Number]:
    """Return the first and second derivatives; Sommer et al., equations 12 and 20."""
    rate = bend = _ZERO
    for weight, speed, change, step in zip(
            weights(u), _weight_rates(u), _weight_bends(u), steps, strict=True):
        back = exp(screws.times(-weight, step))
        rate = _plus(group.adjoint(back, rate), screws.times(speed, step))
        bend = _plus(_plus(group.adjoint(back, bend), screws.times(change, step)),
                     screws.times(speed, group.bracket(rate, step)))
    return rate, bend


def steps_between(group: Group, knots: Array) -> Array:
    """Return the steps (n - 1, 6) from each of the knots (n, 7) to the next."""
    return difference(group, knots[:-1].T, knots[1:].T).T


def difference(group: Group, a: Array, b: Array) -> Array:
    """Return the tangents (6, ...) at elements a that lead to b, both (7, ...)."""
    return np.stack(group.log_many(group.compose(group.inverse(tuple(a)), tuple(b))))


def moved(group: Group, a: Array, tangents: Array) -> Array:
    """Return elements (7, ...) moved along tangents (6, ...)."""
    return np.stack(group.compose(tuple(a), group.exp_many(tuple(tangents))))


def _plus(one: Iterable[Number], other: Iterable[Number]) -> tuple[Any, ...]:
    return tuple(a + b for a, b in zip(one, other, strict=True))


# --- R^3 x SO(3)


def _split_compose(a: Seven[Number], b: Seven[Number]) -> Seven[Number]:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2]) + so3.multiply(a[3:], b[3:])


def _split_inverse(a: Seven[Number]) -> Seven[Number]:
    x, y, z, qx, qy, qz, qw = a
    return -x, -y, -z, -qx, -qy, -qz, qw


def _split_exp(tangent: Six[float]) -> Seven[float]:
    return *tangent[:3], *so3.exp(tangent[3:])


def _split_exp_many(tangent: Six[Array]) -> Seven[Array]:
    return *tangent[:3], *so3.exp_columns(*tangent[3:])


def _split_log(pose: Seven[float]) -> Six[float]:
    return *pose[:3], *so3.log(pose[3:])


def _split_log_many(pose: Seven[Array]) -> Six[Array]:
    return *pose[:3], *so3.log_columns(*pose[3:])


def _split_adjoint(pose: Seven[Number], tangent: Six[Number]) -> Six[Number]:
    return tangent[:3] + so3.rotate(pose[3:], tangent[3:])


def _split_bracket(a: Six[Number], b: Sequence[Number]) -> Six[Number]:
    return _ZERO[:3] + screws.cross(a[3:], b[3:])


def _split_in_childs_axes(pose: Seven[Number], rate: Six[Number],
                          bend: Six[Number]) -> Rates[Number]:
    back = so3.conjugate(pose[3:])
    return so3.rotate(back, rate[:3]) + rate[3:], so3.rotate(back, bend[:3]) + bend[3:]


# --- SE(3)


def _compose(a: Seven[Number], b: Seven[Number]) -> Seven[Number]:
    x, y, z = so3.rotate(a[3:], b[:3])
    return (a[0] + x, a[1] + y, a[2] + z) + so3.multiply(a[3:], b[3:])


def _exp_many(tangent: Six[Array]) -> Seven[Array]:
    return so3.columns(screws.exp_many(so3.joined(tangent)))  # type: ignore[no-any-return]


def _log_many(pose: Seven[Array]) -> Six[Array]:
    return so3.columns(screws.log_many(so3.joined(pose)))  # type: ignore[no-any-return]


def _adjoint(pose: Seven[Number], tangent: Six[Number]) -> Six[Number]:
    w = so3.rotate(pose[3:], tangent[3:])
    return _plus(so3.rotate(pose[3:], tangent[:3]), screws.cross(pose[:3], w)) + w


def _bracket(a: Six[Number], b: Sequence[Number]) -> Six[Number]:
    moved, turned = screws.cross(a[:3], b[3:]), screws.cross(a[3:], b[3:])
    return _plus(screws.cross(a[3:], b[:3]), moved) + turned


def _in_childs_axes(pose: Seven[Number], rate: Six[Number], bend: Six[Number]) -> Rates[Number]:
    """Return the twist, and the acceleration with the term for the rotation of the axes."""
    return rate, _plus(bend[:3], screws.cross(rate[3:], rate[:3])) + bend[3:]


SPLIT = Group('R3 x SO(3)', _split_compose, _split_inverse, _split_exp, _split_exp_many,
              _split_log, _split_log_many, _split_adjoint, _split_bracket, _split_in_childs_axes)
SE3 = Group('SE(3)', _compose, se3.inverse_columns, screws.exp, _exp_many, screws.log, _log_many,
            _adjoint, _bracket, _in_childs_axes)
