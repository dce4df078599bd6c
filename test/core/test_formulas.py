# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Each formula against its definition, written out in loops.

Products, inverses and matrices are polynomials, so whole numbers show a wrong term exactly: here
the quaternions need not have length one.
"""

from fractions import Fraction
import functools
import itertools
import math
import random

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.core.geometry import chain, se3, so3

RANDOM = random.Random(5)
NUMBERS = [tuple(float(RANDOM.randint(-9, 9) or 4) for _ in range(7)) for _ in range(12)]
PAIRS = list(zip(NUMBERS, NUMBERS[1:] + NUMBERS[:1], strict=True))
HALF = math.sqrt(0.5)

# Rotations whose matrices are exact, as multiples of unit quaternions: all with components of
# equal size, except those with three, whose square of the length is no power of two.
EQUAL_PARTS = [q for q in itertools.product((-1.0, 0.0, 1.0), repeat=4)
               if sum(map(abs, q)) in (1.0, 2.0, 4.0)]


def unit(q):
    size = math.sqrt(sum(value * value for value in q))
    return tuple(value / size for value in q)


def cross(a, b):
    return tuple(a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]
                 for i in range(3))


def product(a, b):
    """Return the product of two quaternions, from that of their units: i j = k, j i = -k."""
    result = [0.0] * 4
    for (i, one), (j, other) in itertools.product(enumerate(a), enumerate(b)):
        if 3 in (i, j):
            result[min(i, j)] += one * other
        elif i == j:
            result[3] -= one * other
        else:
            result[3 - i - j] += one * other * (1 if j == (i + 1) % 3 else -1)
    return tuple(result)


def turned(q, v):
    *u, w = q
    once = cross(u, v)
    twice = cross(u, once)
    return tuple(v[i] + 2.0 * w * once[i] + 2.0 * twice[i] for i in range(3))


def conjugated(q):
    return (-q[0], -q[1], -q[2], q[3])


def composed(a, b):
    return (*(a[i] + moved for i, moved in enumerate(turned(a[3:], b[:3]))),
            *product(a[3:], b[3:]))


def inverted(pose):
    back = conjugated(pose[3:])
    return (*turned(back, [-value for value in pose[:3]]), *back)


def grid(rows):
    """Return an array with two rows of the numbers, because one index may be right by chance."""
    return np.reshape(np.array(rows), (2, len(rows) // 2, -1))


def flat(array):
    return [tuple(row) for row in np.reshape(array, (-1, np.shape(array)[-1])).tolist()]


# --- polynomials, exactly


def test_product_of_quaternions_is_that_of_their_units():
    expected = [product(a[3:], b[3:]) for a, b in PAIRS]
    assert [so3.multiply(a[3:], b[3:]) for a, b in PAIRS] == expected
    a, b = map(grid, zip(*PAIRS, strict=True))
    assert flat(so3.multiply_many(a[..., 3:], b[..., 3:])) == expected


def test_conjugate_turns_the_vector_part():
    expected = [conjugated(a[3:]) for a in NUMBERS]
    assert [so3.conjugate(a[3:]) for a in NUMBERS] == expected
    assert flat(so3.conjugate_many(grid(NUMBERS)[..., 3:])) == expected


def test_rotation_of_a_vector_is_the_one_of_two_cross_products():
    expected = [turned(a[3:], b[:3]) for a, b in PAIRS]
    assert [so3.rotate(a[3:], b[:3]) for a, b in PAIRS] == expected
    a, b = map(grid, zip(*PAIRS, strict=True))
    assert flat(so3.rotate_many(a[..., 3:], b[..., :3])) == expected


def test_columns_of_the_matrix_are_the_rotated_axes():
    axes = [tuple(float(i == k) for i in range(3)) for k in range(3)]
    for pose in NUMBERS:
        expected = np.transpose([turned(pose[3:], axis) for axis in axes]).tolist()
        assert [list(row) for row in so3.as_matrix(pose[3:])] == expected
        whole = [[*row, value] for row, value in zip(expected, pose[:3], strict=True)]
        assert se3.as_matrix(pose).tolist() == [*whole, [0.0, 0.0, 0.0, 1.0]]
    many = grid(NUMBERS)
    assert se3.as_matrix_many(many).reshape(-1, 4, 4).tolist() == [
        se3.as_matrix(pose).tolist() for pose in NUMBERS]
    assert so3.as_matrix_many(many[..., 3:]).shape == (2, 6, 3, 3)


def test_composition_rotates_and_adds():
    expected = [composed(a, b) for a, b in PAIRS]
    assert [chain.compose(a, b) for a, b in PAIRS] == expected
    a, b = map(grid, zip(*PAIRS, strict=True))
    assert flat(se3.compose_many(a, b)) == expected


def test_inverse_rotates_back():
    expected = [inverted(pose) for pose in NUMBERS]
    assert [chain.inverse(pose) for pose in NUMBERS] == expected
    assert [se3.inverse_columns(pose) for pose in NUMBERS] == expected
    assert flat(se3.inverse_many(grid(NUMBERS))) == expected
    columns = se3.inverse_columns(tuple(np.transpose(NUMBERS)))
    assert flat(np.stack(columns, axis=-1)) == expected


def test_points_are_rotated_and_moved():
    expected = [composed(a, (*b[:3], 0.0, 0.0, 0.0, 1.0))[:3] for a, b in PAIRS]
    assert [se3.apply(a, b[:3]) for a, b in PAIRS] == expected
    a, b = map(grid, zip(*PAIRS, strict=True))
    assert flat(se3.apply_many(a, b[..., :3])) == expected
    assert flat(se3.apply_many(NUMBERS[0], b[..., :3])) == [
        se3.apply(NUMBERS[0], other[:3]) for _, other in PAIRS]


@for_each(down=range(4), up=range(4))
def test_branches_are_joined_at_the_top(down, up):
    source, target = NUMBERS[:down], NUMBERS[5:5 + up]
    below = [functools.reduce(composed, branch, chain.IDENTITY) for branch in (source, target)]
    assert chain.compose_chain(source) == below[0]
    assert chain.join_branches(source, target) == composed(inverted(below[1]), below[0])


def test_identities_change_nothing():
    assert chain.IDENTITY == se3.IDENTITY == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert so3.IDENTITY == (0.0, 0.0, 0.0, 1.0)


def test_length_of_a_quaternion_is_taken_from_all_its_parts():
    assert so3.normalize((2.0, -4.0, 5.0, 6.0)) == pytest.approx(
        [2 / 9, -4 / 9, 5 / 9, 6 / 9], rel=1e-15)


# --- rotations of any size


ANGLES = [0.0, 1e-200, 1e-12, 1e-6, 0.9e-3, 1.9e-3, 0.5, 2.0, 3.1, 5.0]
AXIS = (2 / 7, -3 / 7, 6 / 7)


def test_exp_is_half_the_angle_about_the_axis():
    vectors = [tuple(angle * value for value in AXIS) for angle in ANGLES]
    many = flat(so3.exp_many(grid(vectors)))
    for angle, vector, row in zip(ANGLES, vectors, many, strict=True):
        sine = math.sin(0.5 * angle) if angle > 1e-100 else 0.5 * angle
        expected = pytest.approx([sine * value for value in AXIS], rel=2e-15, abs=0.0)
        for q in (so3.exp(vector), row):
            assert q[:3] == expected
            assert q[3] == pytest.approx(math.cos(0.5 * angle), abs=1e-15)


def test_log_is_the_angle_along_the_axis():
    rows = []
    for angle in ANGLES:
        sine = math.sin(0.5 * angle) if angle > 1e-100 else 0.5 * angle
        rows.append((*(sine * value for value in AXIS), math.cos(0.5 * angle)))
    many = flat(so3.log_many(grid(rows)))
    negative = flat(so3.log_many(-grid(rows)))
    for angle, q, row, other in zip(ANGLES, rows, many, negative, strict=True):
        short = angle if angle <= math.pi else angle - math.tau
        expected = pytest.approx([short * value for value in AXIS], rel=2e-15, abs=0.0)
        for vector in (row, other, so3.log(q), so3.log(tuple(-value for value in q))):
            assert vector == expected


@pytest.mark.filterwarnings('error')
def test_half_a_turn_has_the_log_of_its_vector_part():
    for q in ((1.0, 0.0, 0.0, 0.0), (0.0, -0.6, 0.8, 0.0), (0.0, 0.0, 0.0, 1.0)):
        expected = [math.pi * value for value in q[:3]]
        assert so3.log(q) == pytest.approx(expected, rel=1e-15)
        assert so3.log_many(np.array(q)) == pytest.approx(expected, rel=1e-15)
    assert so3.exp_many(np.zeros(3)).tolist() == [0.0, 0.0, 0.0, 1.0]


def test_roll_pitch_and_yaw_are_those_of_the_matrix():
    rng = np.random.default_rng(2)
    for q in map(tuple, rng.normal(size=(40, 4)).tolist()):
        m = so3.as_matrix(unit(q))
        expected = (math.atan2(m[2][1], m[2][2]), math.asin(-m[2][0]),
                    math.atan2(m[1][0], m[0][0]))
        assert so3.as_rpy(unit(q)) == pytest.approx(expected, abs=1e-13)
        assert product(so3.from_rpy(*expected), conjugated(unit(q)))[:3] == pytest.approx(
            (0.0, 0.0, 0.0), abs=1e-13)


@pytest.mark.parametrize(('away', 'roll', 'tolerance'), [
    (0.5e-12, 0.0, 0.0), (1.2e-12, 0.0, 0.0), (1.7e-12, 0.3, 2e-3), (2.5e-12, 0.3, 2e-3)])
def test_roll_is_left_out_closer_to_gimbal_lock_than_1e_12(away, roll, tolerance):
    for sign in (1.0, -1.0):
        found, pitch, yaw = so3.as_rpy(so3.from_rpy(0.3, sign * (math.pi / 2 - away), 0.5))
        assert found == pytest.approx(roll, abs=tolerance)
        assert pitch == pytest.approx(sign * math.pi / 2, abs=1e-11)
        assert yaw - sign * found == pytest.approx(0.5 - sign * 0.3, abs=1e-13)
        # At exactly this distance, roll is still defined.
        assert so3.as_rpy((1e-12, sign * HALF, 0.0, HALF))[0] == pytest.approx(math.pi / 2)


# --- signs


def with_sign_of_tf2(q):
    """Return q or -q: w decides if the trace is positive, else the first of the largest parts."""
    square = sum(Fraction(value) ** 2 for value in q)
    positive_trace = 4 * Fraction(q[3]) ** 2 > square
    decisive = q[3] if positive_trace else max(q[:3], key=abs)
    return q if decisive > 0 else tuple(-value for value in q)


def test_sign_is_that_of_w_or_else_of_the_first_of_the_largest_parts():
    mixed = [(0.0, 0.3, -0.9, 0.1), (-0.1, 0.7, 0.6, -0.2), (0.1, -0.2, 0.3, -0.9),
             (-0.8, 0.1, 0.2, 0.5), (0.8, 0.1, 0.2, -0.5)]
    units = [unit(q) for q in EQUAL_PARTS + mixed]
    expected = [with_sign_of_tf2(q) for q in units]
    assert [so3.with_tf2_sign(q) for q in units] == expected
    assert [so3.has_tf2_sign(*q) for q in units] == [
        q == signed for q, signed in zip(units, expected, strict=True)]
    assert flat(so3.with_tf2_sign_many(np.array(units))) == expected
    assert flat(so3.with_tf2_sign_many(np.array([units, units]))) == expected * 2
    assert [flat(so3.with_tf2_sign_many(np.array([q])))[0] for q in units] == expected


def test_matrix_of_tf2_gives_back_the_rotation_with_the_sign_of_tf2():
    for q in EQUAL_PARTS:
        assert chain.through_tf2_matrix(q) == pytest.approx(
            with_sign_of_tf2(unit(q)), rel=1e-15, abs=0.0)
    rng = np.random.default_rng(3)
    for q in map(tuple, rng.normal(size=(60, 4)).tolist()):
        assert chain.through_tf2_matrix(q) == pytest.approx(
            with_sign_of_tf2(unit(q)), rel=0.0, abs=2e-15)


def test_quaternion_of_a_matrix_has_a_positive_w_or_first_part():
    expected = []
    for q in map(unit, EQUAL_PARTS):
        decisive = q[3] or max(q[:3], key=abs)
        expected.append(q if decisive > 0 else tuple(-value for value in q))
    matrices = so3.as_matrix_many(np.array([unit(q) for q in EQUAL_PARTS])).round(12)
    assert so3.from_matrix_many(matrices) == pytest.approx(np.array(expected), abs=1e-15)
    pairs = so3.from_matrix_many(matrices.reshape(-1, 2, 3, 3))
    assert pairs == pytest.approx(np.array(expected).reshape(-1, 2, 4), abs=1e-15)
    for matrix, q in zip(matrices, expected, strict=True):
        assert so3.from_matrix(matrix) == pytest.approx(q, abs=1e-15)


def test_matrix_may_differ_from_a_rotation_by_a_millionth():
    for excess in (0.9e-6, -0.9e-6):
        assert so3.from_matrix(np.diag([math.sqrt(1.0 + excess), 1.0, 1.0])) == pytest.approx(
            so3.IDENTITY, abs=1e-6)
    for excess in (1.2e-6, -1.2e-6):
        for diagonal in ([1.0, math.sqrt(1.0 + excess), 1.0], [1.0, 1.0, math.sqrt(1.0 + excess)]):
            with pytest.raises(ValueError, match='differs from I by more than 1e-6'):
                so3.from_matrix(np.diag(diagonal))
    with pytest.raises(ValueError, match='differs from I'):
        so3.from_matrix([[1.0, 1e-6, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def test_last_row_of_a_matrix_may_differ_by_a_billionth():
    for place in range(4):
        matrix = np.eye(4)
        matrix[3, place] += 0.9e-9
        assert se3.from_matrix(matrix) == se3.IDENTITY
        matrix[3, place] += 0.3e-9
        with pytest.raises(ValueError, match='the last row of the matrix is not 0 0 0 1'):
            se3.from_matrix(matrix)


# --- between two poses


@for_each(angle=[1e-3, 0.4, 1.0, 1.5], ratio=[0.0, 0.2, 0.5, 0.9, 1.0, 1.3])
def test_weights_are_those_of_shoemake(angle, ratio):
    first, second = (math.sin((1.0 - ratio) * angle) / math.sin(angle),
                     math.sin(ratio * angle) / math.sin(angle))
    for sign in (1.0, -1.0):
        expected = pytest.approx((first, sign * second), rel=1e-9, abs=1e-12)
        cosine = sign * math.cos(angle)
        assert so3.slerp_weights(cosine, ratio) == expected
        assert so3.slerp_weights(cosine, ratio, True) == expected
        for as_tf2, others in itertools.product((False, True), ([], [1.0])):
            weights = so3.slerp_weights_many(np.array([cosine, *others]), np.array(ratio), as_tf2)
            assert tuple(each[0] for each in weights) == expected


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize(('cosine', 'exact', 'of_tf2'), [
    (1.0, (0.75, 0.25), (1.0, 0.0)), (1.0 + 2e-16, (0.75, 0.25), (1.0, 0.0)),
    (-1.0, (0.75, -0.25), (1.0, 0.0)),
    (0.0, (math.cos(math.pi / 8), math.sin(math.pi / 8)),
     (math.cos(math.pi / 8), math.sin(math.pi / 8))),
])
def test_weights_of_equal_and_of_opposite_rotations(cosine, exact, of_tf2):
    for as_tf2, expected in ((False, exact), (True, of_tf2)):
        expected = pytest.approx(expected, rel=1e-15, abs=0.0)
        assert so3.slerp_weights(cosine, 0.25, as_tf2) == expected
        for others in ([], [0.5]):
            weights = so3.slerp_weights_many(np.array([cosine, *others]), np.array(0.25), as_tf2)
            assert tuple(float(each[0]) for each in weights) == expected
    assert so3.slerp_weights(cosine, 0.25) == so3.slerp_weights(cosine, 0.25, False)


def test_half_turn_begins_at_a_dot_product_of_1e_15():
    cosines = np.array([0.0, 0.9e-15, -0.9e-15, 1e-15, -1e-15, 1.1e-15, -1.1e-15, 1.0, -1.0])
    assert so3.is_half_turn(cosines).tolist() == [True] * 3 + [False] * 6


@pytest.mark.parametrize(('first', 'second', 'halfway'), [
    # Half a turn: tf2's matrix decides the way round, whatever the sign was.
    ((0.0, 0.0, 0.0, 1.0), (-1.0, 0.0, 0.0, 0.0), (HALF, 0.0, 0.0, HALF)),
    ((0.0, 0.0, 0.0, -1.0), (0.0, -1.0, 0.0, 0.0), (0.0, HALF, 0.0, HALF)),
    ((0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, HALF, HALF, 0.0)),
    # A little less than half a turn: the shorter way.
    ((0.0, 0.0, 0.0, 1.0), (-1.0, 0.0, 0.0, 1e-14), (-HALF, 0.0, 0.0, HALF)),
    ((0.0, 0.0, 0.0, 1.0), (-1.0, 0.0, 0.0, -1e-14), (HALF, 0.0, 0.0, HALF)),
])
def test_way_round_between_two_samples(first, second, halfway):
    pair = (1.0, 2.0, 3.0, *first, 5.0, -6.0, 7.0, *second)
    found = chain.between_samples(pair, 15, 10, 20)
    assert found == pytest.approx((3.0, -2.0, 5.0, *halfway), abs=1e-13)
    many = se3.interpolate_many(np.array([pair[:7]]), np.array([pair[7:]]), np.array([0.5]), True)
    assert many[0] == pytest.approx(found, abs=1e-13)


def test_interpolation_of_many_is_that_of_each_also_beside_a_half_turn():
    """Each row has to be rounded as tf2 rounds, whatever the other rows are."""
    q = unit((1.0, 2.0, -3.0, 4.0))
    pairs = [((1.0, 2.0, 3.0, *q), (4.0, 6.0, 8.0, *unit((1.0, 2.1, -3.0, 4.0)))),
             ((1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), (4.0, 6.0, 8.0, 1e-9, 0.0, 0.0, 1.0)),
             ((1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), (4.0, 6.0, 8.0, -1e-9, 0.0, 0.0, -1.0)),
             ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 0.0, -1.0, 0.0, 0.0)),
             ((1.0, 2.0, 3.0, *q), (4.0, 6.0, 8.0, *unit((-1.0, 2.0, 3.0, -4.0)))),
             ((0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0), (1.0, 1.0, 1.0, 0.6, 0.8, 0.0, 0.0))]
    a, b = (grid(rows) for rows in zip(*pairs, strict=True))
    ratio = np.array([[0.25, 0.5, 0.75], [0.5, 0.1, 0.3]])
    for as_tf2, rows in ((True, slice(None)), (True, slice(1)), (False, slice(None))):
        found = se3.interpolate_many(a[rows], b[rows], ratio[rows], as_tf2)
        assert found.shape == a[rows].shape
        for row, pair, u in zip(flat(found), pairs, ratio[rows].ravel().tolist(), strict=False):
            expected = (chain.between_samples((*pair[0], *pair[1]), round(1000 * u), 0, 1000)
                        if as_tf2 else se3.interpolate(*pair, u))
            assert row == pytest.approx(expected, rel=1e-14, abs=1e-20)
    assert flat(se3.interpolate_many(a, b, ratio)) == flat(found)
    one = se3.interpolate_many(np.array(pairs[0][0]), b[0], ratio[0], True)
    assert one.shape == (3, 7)


def test_stamps_far_apart_are_divided_as_floats():
    """In Python, the quotient of two integers has another last bit than that of two floats."""
    pair = (*chain.IDENTITY, 1.0, *chain.IDENTITY[1:])
    first, last = -7, 2 ** 54 - 10_001
    differ = 0
    for stamp in range(2 ** 53, 2 ** 53 + 2_000, 31):
        ratio = float(stamp - first) / float(last - first)
        assert chain.between_samples(pair, stamp, first, last)[0] == ratio
        differ += ratio != (stamp - first) / (last - first)
    assert differ


def test_distance_is_of_the_origins_and_of_the_shorter_turn():
    for angle in (0.0, 1e-3, 1.0, 3.0, 4.0):
        sine, cosine = math.sin(0.5 * angle), math.cos(0.5 * angle)
        a = (1.0, 2.0, 3.0, *unit((1.0, -2.0, 3.0, 4.0)))
        step = tuple(sine * value for value in AXIS)
        b = (3.0, 8.0, 6.0, *product(a[3:], (*step, cosine)))
        expected = pytest.approx((7.0, min(angle, math.tau - angle)), rel=1e-14, abs=2e-15)
        metres, radians = se3.distance_many(np.array([[a, b]]), np.array([[b, b]]))
        for found in (se3.distance(a, b), se3.distance(b, a), (metres[0, 0], radians[0, 0])):
            assert found == expected
        assert (metres[0, 1], radians[0, 1]) == (0.0, 0.0)
