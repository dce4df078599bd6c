# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The formulas of every lookup: poses along a chain, interpolated, multiplied and inverted.

Poses are tuples of seven plain floats, as in ``se3``, which has all formulas for poses. Pure
functions: no state, any thread.

Lookups spend most of their time here, so ``tree/path_in_c.c`` repeats ``join_branches`` and
``between_samples`` in C, to the last bit: a change of one is a change of both.
"""

from math import acos, cos, sin, sqrt

Quaternion = tuple[float, float, float, float]
PoseTuple = tuple[float, float, float, float, float, float, float]

IDENTITY: PoseTuple = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

# Rotations whose quaternions have a smaller dot product are half a turn apart, except for
# rounding.
HALF_TURN = 1e-15


def join_branches(top_T_source: list[PoseTuple], top_T_target: list[PoseTuple]) -> PoseTuple:
    """
    Return ``target_T_source``: inverse(top_T_target) top_T_source.

    :param top_T_source: the poses ``parent_T_child`` of a branch, from the top down.
    :param top_T_target: those of the other branch; either may have none.
    """
    down = compose_chain(top_T_source)
    return compose(inverse(compose_chain(top_T_target)), down) if top_T_target else down


def compose_chain(poses: list[PoseTuple]) -> PoseTuple:
    """
    Return the product of poses, the leftmost first: a_T_b, b_T_c, ... -> a_T_z.

    The product (t1 + q1 t2 q1*, q1 q2) is written out, with ``so3.rotate`` and
    ``so3.multiply`` inlined, because this is the inner loop of every lookup.

    :param poses: any number of poses; without any, the result is the identity.
    """
    if not poses:
        return IDENTITY
    if len(poses) == 1:
        return poses[0]
    x, y, z, qx, qy, qz, qw = poses[0]
    for tx, ty, tz, rx, ry, rz, rw in poses[1:]:
        cx = qy * tz - qz * ty
        cy = qz * tx - qx * tz
        cz = qx * ty - qy * tx
        cx += cx
        cy += cy
        cz += cz
        x += tx + qw * cx + qy * cz - qz * cy
        y += ty + qw * cy + qz * cx - qx * cz
        z += tz + qw * cz + qx * cy - qy * cx
        qx, qy, qz, qw = (
            qw * rx + qx * rw + qy * rz - qz * ry,
            qw * ry - qx * rz + qy * rw + qz * rx,
            qw * rz + qx * ry - qy * rx + qz * rw,
            qw * rw - qx * rx - qy * ry - qz * rz,
        )
    return (x, y, z, qx, qy, qz, qw)


def compose(a_T_b: PoseTuple, b_T_c: PoseTuple) -> PoseTuple:
    """Return a_T_c."""
    return compose_chain([a_T_b, b_T_c])


def inverse(a_T_b: PoseTuple) -> PoseTuple:
    """Return b_T_a: (-q* t q, q*), with ``so3.rotate`` inlined."""
    x, y, z, qx, qy, qz, qw = a_T_b
    cx = 2.0 * (qy * z - qz * y)
    cy = 2.0 * (qz * x - qx * z)
    cz = 2.0 * (qx * y - qy * x)
    return (
        -x + qw * cx - qy * cz + qz * cy,
        -y + qw * cy - qz * cx + qx * cz,
        -z + qw * cz - qx * cy + qy * cx,
        -qx, -qy, -qz, qw,
    )


def between_samples(pair: tuple[float, ...], stamp: int, first: int, last: int) -> PoseTuple:
    """
    Return the pose between two successive samples.

    It is that of ``se3.interpolate`` with tf2's rounding: ``as_tf2`` of ``slerp_weights``.

    :param pair: the poses of both, as they lie in a history's memory.
    :param stamp: nanoseconds, from ``first`` to ``last``, the stamps of the two.
    """
    ax, ay, az, aqx, aqy, aqz, aqw, bx, by, bz, bqx, bqy, bqz, bqw = pair
    cosine = aqx * bqx + aqy * bqy + aqz * bqz + aqw * bqw
    if -HALF_TURN < cosine < HALF_TURN:
        aqx, aqy, aqz, aqw = through_tf2_matrix((aqx, aqy, aqz, aqw))
        bqx, bqy, bqz, bqw = through_tf2_matrix((bqx, bqy, bqz, bqw))
        cosine = aqx * bqx + aqy * bqy + aqz * bqz + aqw * bqw
    # Of floats, as in C, which rounds large integers before it divides.
    ratio = 1.0 * (stamp - first) / (last - first)
    left = 1.0 - ratio
    one, other = slerp_weights(cosine, ratio, True)
    return (
        left * ax + ratio * bx,
        left * ay + ratio * by,
        left * az + ratio * bz,
        one * aqx + other * bqx,
        one * aqy + other * bqy,
        one * aqz + other * bqz,
        one * aqw + other * bqw,
    )


def slerp_weights(cosine: float, ratio: float, as_tf2: bool = False) -> tuple[float, float]:
    """
    Return the weights of two unit quaternions in their spherical interpolation.

    They are sin((1 - u) t) / sin t and sin(u t) / sin t (Shoemake, "Animating Rotation with
    Quaternion Curves", 1985), with t the angle between the first and the nearer one of
    +-second. The weights are also accurate for very small angles: acos(cosine) may be wrong in
    half of its digits there, but the weights depend on it only in second order.

    :param cosine: the dot product of the two, -1 to 1.
    :param ratio: u, 0 for the first, 1 for the second.
    :param as_tf2: return 1 and 0 if the two are closer than 3e-8 rad, where the cosine rounds
        to one, as tf2's slerp does. Otherwise the weights are exact.
    """
    near = abs(cosine)
    if near < 1.0:
        angle = acos(near)
        second = sin(ratio * angle) / sin(angle)
        first = cos(ratio * angle) - near * second
    elif as_tf2:
        return 1.0, 0.0
    else:
        first, second = 1.0 - ratio, ratio
    return (first, second) if cosine >= 0.0 else (first, -second)


def through_tf2_matrix(q: Quaternion) -> Quaternion:
    """
    Return a unit quaternion converted to tf2's matrix and back.

    tf2 stores every rotation this way (``Matrix3x3::setRotation``, then ``getRotation``, with
    the same order of operations). If two rotations are half a turn apart, the rounding of these
    conversions determines the direction of the interpolation.
    """
    x, y, z, w = q
    s = 2.0 / (x * x + y * y + z * z + w * w)
    xs, ys, zs = x * s, y * s, z * s
    wx, wy, wz, xx, xy, xz = w * xs, w * ys, w * zs, x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    m = ((1.0 - (yy + zz), xy - wz, xz + wy), (xy + wz, 1.0 - (xx + zz), yz - wx),
         (xz - wy, yz + wx, 1.0 - (xx + yy)))
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0.0:
        root = sqrt(trace + 1.0)
        s = 0.5 / root
        return ((m[2][1] - m[1][2]) * s, (m[0][2] - m[2][0]) * s, (m[1][0] - m[0][1]) * s,
                root * 0.5)
    i = (2 if m[1][1] < m[2][2] else 1) if m[0][0] < m[1][1] else (
        2 if m[0][0] < m[2][2] else 0)
    j, k = (i + 1) % 3, (i + 2) % 3
    root = sqrt(m[i][i] - m[j][j] - m[k][k] + 1.0)
    s = 0.5 / root
    vector = {i: root * 0.5, j: (m[j][i] + m[i][j]) * s, k: (m[k][i] + m[i][k]) * s}
    return vector[0], vector[1], vector[2], (m[k][j] - m[j][k]) * s
