# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Many covariances as 21 rows: the upper triangle, row by row, as in ``covariances.pack``.

A row is an array, all of one shape. The products are written out, because numpy is
fastest on long rows: a product of matrices (6, 6) costs as much as a hundred numbers of a row.
A matrix (3, 3) has nine rows in the same way.
"""

from collections.abc import Iterable

from tf_tree_py.core.geometry.so3 import Array

Rows = tuple[Array, ...]
"""21 rows of a covariance, or 9 of a matrix, or 3 of a vector."""


def carried(a_R_b: Rows, lever: Rows, covariance: Rows) -> Rows:
    """
    Return the covariance of another point on the same rigid body: see ``covariances.carried``.

    With L = -[l]x and the blocks P, Q, S of the turned covariance: S stays, Q becomes Q + L S,
    and P becomes P + L Q^T + (Q + L S) L^T.
    """
    of_both, of_position, of_rotation = _blocks(covariance)
    position, rotation = (_full(_congruent(a_R_b, one)) for one in (of_position, of_rotation))
    both = product(product(a_R_b, of_both), _transposed(a_R_b))
    moved = _minus(both, _crossed(lever, rotation))
    once = _minus(position, _transposed(_crossed(lever, _transposed(both))))
    return _joined(_minus(once, _crossed(lever, _transposed(moved))), moved, rotation)


def turned(matrix: Rows, covariance: Rows) -> Rows:
    """Return a covariance whose rotation is multiplied by a matrix from the left."""
    of_both, of_position, of_rotation = _blocks(covariance)
    return _joined(_full(of_position), product(of_both, _transposed(matrix)),
                   _full(_congruent(matrix, of_rotation)))


def _blocks(covariance: Rows) -> tuple[Rows, Rows, Rows]:
    """Return the off-diagonal block, 9 rows, and those of position and rotation, 6 rows each."""
    xx, xy, xz, a, b, c, yy, yz, d, e, f, zz, g, h, i, *rotation = covariance
    return (a, b, c, d, e, f, g, h, i), (xx, xy, xz, yy, yz, zz), tuple(rotation)


def _joined(position: Rows, both: Rows, rotation: Rows) -> Rows:
    """Return the covariance with three given blocks, 9 rows each."""
    return (*position[:3], *both[:3], *position[4:6], *both[3:6], position[8], *both[6:],
            *rotation[:3], *rotation[4:6], rotation[8])


def _full(symmetric: Rows) -> Rows:
    xx, xy, xz, yy, yz, zz = symmetric
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


def _transposed(m: Rows) -> Rows:
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


def _minus(a: Rows, b: Rows) -> Rows:
    return tuple(one - other for one, other in zip(a, b, strict=True))


def product(a: Rows, b: Rows) -> Rows:
    """Return the product of two matrices."""
    rows, columns = (a[:3], a[3:6], a[6:]), (b[::3], b[1::3], b[2::3])
    return tuple(_dot(row, column) for row in rows for column in columns)


def _congruent(a: Rows, symmetric: Rows) -> Rows:
    """Return A S A^T, 6 rows."""
    half = product(a, _full(symmetric))
    rows, columns = (half[:3], half[3:6], half[6:]), (a[:3], a[3:6], a[6:])
    return tuple(_dot(rows[i], columns[j]) for i in range(3) for j in range(i, 3))


def _dot(a: Rows, b: Rows) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _crossed(vector: Rows, m: Rows) -> Rows:
    """Return [v]x M."""
    x, y, z = vector
    a, b, c, d, e, f, g, h, i = m
    return (y * g - z * d, y * h - z * e, y * i - z * f,
            z * a - x * g, z * b - x * h, z * c - x * i,
            x * d - y * a, x * e - y * b, x * f - y * c)


def weighted_sum(first: Array, one: Iterable[Array | float], second: Array, other: Rows) -> Rows:
    """Return the weighted sum of rows, of which the first may be floats."""
    return tuple(first * a + second * b for a, b in zip(one, other, strict=True))
