# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``tf_transformations`` and ``tf2_kdl``, which programs import together with tf2_ros."""

import inspect
from itertools import product
import math

from dropin_helpers import run
from hypothesis import assume, given, strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tf_tree_py.dropin import rarer_matrices as rarer, transformations as ours

# The name, and Gohlke's code: first axis, parity, repetition, whether the axes rotate along.
SEQUENCES = {
    'sxyz': (0, 0, 0, 0), 'sxyx': (0, 0, 1, 0), 'sxzy': (0, 1, 0, 0), 'szyz': (2, 1, 1, 0),
    'rzyx': (0, 0, 0, 1), 'rxzy': (1, 0, 0, 1), 'rxyz': (2, 1, 0, 1), 'rzyz': (2, 1, 1, 1)}
ANGLES = [(0.3, -0.5, 2.0), (-2.9, 1.2, 0.1), (1.0, 0.7, -3.0)]


def turned(angle, axis):
    return Rotation.from_rotvec(angle * np.eye(3)['xyz'.index(axis)]).as_matrix()


def by_hand(angles, axes):
    """Return the matrix of Euler angles, one rotation after another."""
    matrix = np.eye(3)
    for angle, axis in zip(angles, axes[1:], strict=True):
        one = turned(angle, axis)
        matrix = one @ matrix if axes[0] == 's' else matrix @ one
    return matrix


@pytest.mark.parametrize('axes', SEQUENCES)
def test_angles_turn_one_after_another_about_the_named_axes(axes):
    for angles in ANGLES:
        expected = by_hand(angles, axes)
        for sequence in (axes, SEQUENCES[axes]):
            np.testing.assert_allclose(
                ours.euler_matrix(*angles, sequence)[:3, :3], expected, atol=1e-15)
        quaternion = ours.quaternion_from_euler(*angles, axes)
        np.testing.assert_allclose(ours.quaternion_matrix(quaternion)[:3, :3], expected,
                                   atol=1e-15)
        again = ours.euler_from_quaternion(quaternion, axes)
        np.testing.assert_allclose(by_hand(again, axes), expected, atol=1e-12)


def test_range_of_the_middle_angle_is_gohlkes():
    for angles in ANGLES:
        assert 0 <= ours.euler_from_matrix(by_hand(angles, 'sxyx'), 'sxyx')[1] <= math.pi
        assert -math.pi <= ours.euler_from_matrix(by_hand(angles, 'szyz'), 'szyz')[1] <= 0


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('axes', SEQUENCES)
def test_gimbal_lock_is_no_warning_and_the_same_rotation(axes):
    for angles in product((0.0, 0.4), (0.0, math.pi / 2, -math.pi / 2, math.pi), (0.0, -1.0)):
        matrix = by_hand(angles, axes)
        np.testing.assert_allclose(
            by_hand(ours.euler_from_matrix(matrix, axes), axes), matrix, atol=1e-7)


def test_documented_examples_have_their_documented_answers():
    # From Gohlke's documentation.
    np.testing.assert_allclose(ours.quaternion_multiply([1, -2, 3, 4], [-5, 6, 7, 8]),
                               [-44, -14, 48, 28])
    np.testing.assert_allclose(ours.quaternion_from_euler(1, 2, 3, 'ryxz'),
                               [0.310622, -0.718287, 0.444435, 0.435953], atol=1e-6)
    np.testing.assert_allclose(ours.quaternion_about_axis(0.123, (1, 0, 0)),
                               [0.06146124, 0, 0, 0.99810947])
    np.testing.assert_allclose(ours.quaternion_matrix(ours.quaternion_about_axis(
        0.123, (1, 0, 0))), ours.rotation_matrix(0.123, (1, 0, 0)), atol=1e-15)
    assert ours.rotation_matrix(math.pi / 2, (0, 0, 1), (1, 0, 0)) @ (0, 0, 0, 1) == (
        pytest.approx([1, -1, 0, 1]))


def test_slerp_takes_the_short_way_unless_asked_for_the_long_one():
    first, last = ours.quaternion_about_axis(0, (0, 0, 1)), ours.quaternion_about_axis(
        1.0, (0, 0, 1))
    half = ours.quaternion_about_axis(0.5, (0, 0, 1))
    np.testing.assert_allclose(ours.quaternion_slerp(first, last, 0.5), half)
    negative = -np.array(last)
    np.testing.assert_allclose(ours.quaternion_slerp(first, negative, 0.5), half)
    long = ours.quaternion_slerp(first, negative, 0.5, shortestpath=False)
    assert abs(long @ half) < 1e-12
    np.testing.assert_array_equal(ours.quaternion_slerp(first, negative, 1.0), negative)
    # Two half turns more; then one, with which Gohlke's formula leaves the unit sphere.
    turned = ours.quaternion_slerp(first, last, 0.25, spin=2)
    np.testing.assert_allclose(
        turned, ours.quaternion_about_axis(0.25 * (1.0 + 4 * math.pi), (0, 0, 1)))
    np.testing.assert_allclose(ours.quaternion_slerp(first, last, 0.5, spin=1),
                               -np.array(half) / math.tan(0.25), atol=1e-12)


def test_matrix_is_taken_apart_into_what_it_was_made_of():
    turn = ours.rotation_matrix(-0.8, (1, 2, 3), (4, 5, 6))
    np.testing.assert_allclose(ours.rotation_matrix(*ours.rotation_from_matrix(turn)), turn)
    moved = ours.concatenate_matrices(ours.translation_matrix((1, 2, 3)), turn)
    np.testing.assert_allclose(ours.translation_from_matrix(moved), turn[:3, 3] + (1, 2, 3))
    assert ours.is_same_transform(ours.inverse_matrix(moved) @ moved, ours.identity_matrix())
    assert ours.quaternion_from_matrix(turn)[3] > 0
    mirror = ours.reflection_matrix((0, 0, 1), (0, 0, 2))
    assert mirror @ (5, 6, 7, 1) == pytest.approx([5, 6, -5, 1])


@pytest.mark.parametrize('axes', ['xyz', 'qxyz', ''])
def test_what_is_no_sequence_of_axes_is_a_sentence(axes):
    with pytest.raises(KeyError, match='is not a sequence such as sxyz or rzyx'):
        ours.euler_matrix(0, 0, 0, axes)


# The public functions of the original package, 1.1.1.
SIGNATURES = {
    'identity_matrix': '()', 'translation_matrix': '(direction)',
    'translation_from_matrix': '(matrix)', 'reflection_matrix': '(point, normal)',
    'reflection_from_matrix': '(matrix)', 'rotation_matrix': '(angle, direction, point=None)',
    'rotation_from_matrix': '(matrix)',
    'scale_matrix': '(factor, origin=None, direction=None)', 'scale_from_matrix': '(matrix)',
    'projection_matrix': '(point, normal, direction=None, perspective=None, pseudo=False)',
    'projection_from_matrix': '(matrix, pseudo=False)',
    'clip_matrix': '(left, right, bottom, top, near, far, perspective=False)',
    'shear_matrix': '(angle, direction, point, normal)', 'shear_from_matrix': '(matrix)',
    'decompose_matrix': '(matrix)',
    'compose_matrix':
        '(scale=None, shear=None, angles=None, translate=None, perspective=None)',
    'orthogonalization_matrix': '(lengths, angles)',
    'superimposition_matrix': '(v0, v1, scaling=False, usesvd=True)',
    'euler_matrix': "(ai, aj, ak, axes='sxyz')", 'euler_from_matrix': "(matrix, axes='sxyz')",
    'euler_from_quaternion': "(quaternion, axes='sxyz')",
    'quaternion_from_euler': "(ai, aj, ak, axes='sxyz')",
    'quaternion_about_axis': '(angle, axis)', 'quaternion_matrix': '(quaternion)',
    'quaternion_from_matrix': '(matrix)', 'quaternion_multiply': '(quaternion1, quaternion0)',
    'quaternion_conjugate': '(quaternion)', 'quaternion_inverse': '(quaternion)',
    'quaternion_slerp': '(quat0, quat1, fraction, spin=0, shortestpath=True)',
    'random_quaternion': '(rand=None)', 'random_rotation_matrix': '(rand=None)',
    'Arcball': '(initial=None)', 'arcball_map_to_sphere': '(point, center, radius)',
    'arcball_constrain_to_axis': '(point, axis)', 'arcball_nearest_axis': '(point, axes)',
    'vector_norm': '(data, axis=None, out=None)', 'unit_vector': '(data, axis=None, out=None)',
    'random_vector': '(size)', 'inverse_matrix': '(matrix)',
    'concatenate_matrices': '(*matrices)', 'is_same_transform': '(matrix0, matrix1)',
}
ARCBALL = {
    'place': '(self, center, radius)', 'setaxes': '(self, *axes)',
    'setconstrain': '(self, constrain)', 'getconstrain': '(self)', 'down': '(self, point)',
    'drag': '(self, point)', 'next': '(self, acceleration=0.0)', 'matrix': '(self)'}


def bare_signature(function):
    """Return a signature without its annotations."""
    signature = inspect.signature(function)
    return str(signature.replace(return_annotation=inspect.Signature.empty, parameters=[
        one.replace(annotation=inspect.Parameter.empty)
        for one in signature.parameters.values()]))


def test_every_function_of_the_package_has_its_signature():
    homes = {**vars(ours), **vars(rarer)}
    assert {name: bare_signature(homes[name]) for name in SIGNATURES} == SIGNATURES
    assert {name: bare_signature(getattr(rarer.Arcball, name)) for name in ARCBALL} == ARCBALL


def test_a_star_import_has_every_name_of_the_package(program):
    done = dropped_in(program, """
        from tf_transformations import *
        print(*sorted(name for name in dir() if name[0] != '_'))
    """)
    assert set(done.stdout.split()) == {
        *SIGNATURES, 'math', 'numpy', 'ROTATION_IDENTITY', 'SHEAR_IDENTITY',
        'TRANSLATION_IDENTITY', 'ZOOM_IDENTITY'}, done.stderr


# --- against transforms3d, which the original package wraps

# Thousandths: LAPACK scales rows by what is tiny in them, which changes its signs.
numbers = st.integers(-3000, 3000).map(lambda number: number / 1000)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
axes = vectors.filter(lambda axis: np.linalg.norm(axis) > 0.1)
factors = st.floats(0.1, 3.0)


def same(first, second):
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.fixture(scope='module')
def theirs():
    return pytest.importorskip('transforms3d', reason='pip install transforms3d')


@given(numbers, axes, vectors)
def test_rotations_scales_and_reflections_are_theirs(theirs, angle, axis, point):
    assume(abs(angle) > 1e-3)
    matrix = ours.rotation_matrix(angle, axis, point)
    same(matrix, theirs.axangles.axangle2aff(axis, angle, point))
    their_axis, their_angle, their_point = theirs.axangles.aff2axangle(matrix)
    same(ours.rotation_from_matrix(matrix), (their_angle, their_axis, their_point))
    for direction in (axis, None):
        matrix = ours.scale_matrix(angle, point, direction)
        same(matrix, theirs.zooms.zfdir2aff(angle, direction, point))
        assume(abs(angle - 1.0) > 1e-3)
        factor, their_axis, origin = theirs.zooms.aff2zfdir(matrix)
        found = ours.scale_from_matrix(matrix)
        same(found[:2], (factor, origin))
        assert (found[2] is None) == (their_axis is None)
        same([] if found[2] is None else found[2], [] if their_axis is None else their_axis)
    matrix = ours.reflection_matrix(point, axis)
    same(matrix, theirs.reflections.rfnorm2aff(axis, point))
    same(ours.reflection_from_matrix(matrix), theirs.reflections.aff2rfnorm(matrix)[::-1])


@given(factors, axes, axes, vectors)
def test_shears_are_theirs(theirs, angle, direction, other, point):
    normal = np.cross(direction, other)
    assume(np.linalg.norm(normal) > 0.1 and abs(angle - math.pi / 2) > 0.1)
    matrix = rarer.shear_matrix(angle, direction, point, normal)
    same(matrix, theirs.shears.sadn2aff(angle, direction, normal, point))
    found = rarer.shear_from_matrix(matrix)
    their_angle, their_direction, their_normal, their_point = theirs.shears.aff2sadn(matrix)
    same(found, (their_angle, their_direction, their_point, their_normal))


@given(st.tuples(factors, factors, factors), vectors, vectors, vectors, st.booleans())
def test_matrix_is_decomposed_as_theirs(theirs, scale, shear, angles, translation, mirrors):
    scale = np.array(scale) * (1, -1 if mirrors else 1, 1)
    matrix = ours.compose_matrix(scale, shear, angles, translation)
    turned = theirs.euler.euler2mat(*angles)
    same(matrix, theirs.affines.compose(translation, turned, scale, shear))
    moved, turned, scale, shear = theirs.affines.decompose(matrix)
    found = ours.decompose_matrix(matrix)
    same(found[:4], (scale, shear, theirs.euler.mat2euler(turned), moved))
    assert found[4] is None
    same(ours.quaternion_from_matrix(matrix), theirs.quaternions.mat2quat(turned)[[1, 2, 3, 0]])


AXES = [''.join(name) for name in product('sr', *3 * ['xyz'])
        if name[1] != name[2] != name[3]]


def code_of(name):
    """Return the code of an order of axes: the first, the handedness, whether it comes again."""
    first, second, third = map('xyz'.index, name[1:] if name[0] == 's' else name[:0:-1])
    return first, (second - first) % 3 - 1, int(first == third), int(name[0] == 'r')


LOCKS = st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi])


@given(st.tuples(numbers, numbers | LOCKS, numbers | LOCKS))
def test_angles_and_signs_are_theirs_also_in_gimbal_lock(theirs, angles):
    for name in AXES:
        matrix = ours.euler_matrix(*angles, name)
        same(matrix[:3, :3], theirs.euler.euler2mat(*angles, name))
        same(ours.euler_from_matrix(matrix, name), theirs.euler.mat2euler(matrix, name))
        same(ours.quaternion_from_euler(*angles, code_of(name)),
             theirs.euler.euler2quat(*angles, name)[[1, 2, 3, 0]])


@pytest.mark.parametrize('axis', [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -2, 3)])
def test_sign_of_a_half_turn_is_theirs(theirs, axis):
    matrix = ours.rotation_matrix(math.pi, axis)
    same(ours.quaternion_from_matrix(matrix),
         theirs.quaternions.mat2quat(theirs.affines.decompose(matrix)[1])[[1, 2, 3, 0]])
    same(ours.rotation_from_matrix(np.identity(4))[1],
         theirs.axangles.aff2axangle(np.identity(4))[0])


# --- by their meaning

@given(vectors, axes, axes, vectors)
def test_projection_moves_points_onto_the_plane_and_is_taken_apart(point, normal, along, eye):
    unit = ours.unit_vector(normal)
    assume(abs(unit @ along) > 0.1 and abs(unit @ (eye - point)) > 0.1 and abs(unit @ eye) > 0.1)
    for options in ({}, {'direction': along}, {'perspective': eye}):
        matrix = rarer.projection_matrix(point, normal, **options)
        for start in np.identity(3) * 5.0:
            moved = matrix @ (*start, 1.0)
            assume(abs(moved[3]) > 1e-3)
            assert unit @ (moved[:3] / moved[3] - point) == pytest.approx(0.0, abs=1e-9)
    flat = rarer.projection_matrix(point, normal)
    deep = rarer.projection_matrix(point, normal, perspective=eye, pseudo=True)
    np.testing.assert_allclose(flat @ deep, matrix, atol=1e-9)
    for one, pseudo in (
            (flat, False), (deep, True), (rarer.projection_matrix(point, normal, along), False)):
        again = rarer.projection_matrix(*rarer.projection_from_matrix(one, pseudo))
        np.testing.assert_allclose(again, one, atol=1e-7)


@given(vectors, st.tuples(factors, factors, factors))
def test_corners_of_a_view_are_at_one(low, size):
    low = np.abs(low) + 0.1
    high = low + size
    bounds = np.ravel((low, high), order='F')
    matrix = rarer.clip_matrix(*bounds)
    same((matrix @ (*low, 1.0), matrix @ (*high, 1.0)), ((-1, -1, -1, 1), (1, 1, 1, 1)))
    seen = rarer.clip_matrix(*bounds, perspective=True) @ (*low, 1.0)
    assert seen[2] / seen[3] == pytest.approx(-1.0, abs=1e-9)
    with pytest.raises(ValueError, match='invalid frustum'):
        rarer.clip_matrix(*bounds[::-1])
    with pytest.raises(ValueError, match='near <= 0'):
        rarer.clip_matrix(-1, 1, -1, 1, 0, 1, perspective=True)


@given(numbers, axes, vectors, factors, st.booleans())
def test_superimposition_finds_the_motion_and_the_scale(angle, axis, moved, factor, usesvd):
    points = np.random.default_rng(0).normal(size=(3, 10))
    matrix = ours.concatenate_matrices(ours.translation_matrix(moved), ours.scale_matrix(factor),
                                       ours.rotation_matrix(angle, axis))
    image = (matrix @ np.vstack((points, np.ones(10))))[:3]
    found = rarer.superimposition_matrix(points, image, scaling=True, usesvd=usesvd)
    np.testing.assert_allclose(found, matrix, atol=1e-9)
    mirrored = rarer.superimposition_matrix(points, points * [[1], [1], [-1]], usesvd=usesvd)
    assert np.linalg.det(mirrored) == pytest.approx(1.0)
    with pytest.raises(ValueError, match='at least 3 points'):
        rarer.superimposition_matrix(points[:, :2], image[:, :2])


def test_crystal_and_trackball_give_the_documented_numbers():
    # From Gohlke's documentation.
    cell = rarer.orthogonalization_matrix([9.8, 12.0, 15.5], [87.2, 80.7, 69.7])
    assert cell.sum() == pytest.approx(43.063229)
    ball = rarer.Arcball(initial=np.identity(4))
    ball.place([320, 320], 320)
    ball.down([500, 250])
    ball.drag([475, 275])
    assert ball.matrix().sum() == pytest.approx(3.90583455)
    ball = rarer.Arcball(initial=[0, 0, 0, 1])
    ball.place([320, 320], 320)
    ball.setaxes([1, 1, 0], [-1, 1, 0])
    ball.setconstrain(True)
    ball.down([400, 200])
    ball.drag([200, 400])
    assert ball.getconstrain() and ball.matrix().sum() == pytest.approx(0.2055924)
    once = ball.matrix()
    ball.next()
    np.testing.assert_allclose(ball.matrix(), once @ once, atol=1e-9)
    with pytest.raises(ValueError, match='a quaternion'):
        rarer.Arcball([1, 2, 3])


def test_singular_matrix_and_what_is_no_reflection_are_sentences():
    with pytest.raises(np.linalg.LinAlgError, match='singular, so it contains no rotation'):
        ours.decompose_matrix(np.zeros((4, 4)))
    with pytest.raises(ValueError, match='eigenvalue -1'):
        ours.reflection_from_matrix(np.identity(4))
    for function in (ours.vector_norm, ours.unit_vector):
        out = np.empty((2, 3) if function is ours.unit_vector else 2)
        assert function(np.ones((2, 3)), axis=1, out=out) is None
        np.testing.assert_allclose(out, function(np.ones((2, 3)), axis=1))
    assert math.isfinite(rarer.shear_from_matrix(np.identity(4))[2].sum())


# --- in a program

def dropped_in(program, code, *options, **folders):
    return run('-m', 'tf_tree_py.dropin', *options, program(code), **folders)


def test_program_imports_it_beside_tf2_ros(program):
    done = dropped_in(program, """
        from tf_transformations import *
        import tf_transformations, tf2_ros
        print(euler_from_quaternion(quaternion_from_euler(0.0, 0.0, 0.5)))
        print(numpy.pi == math.pi, tf_transformations._AXES2TUPLE['sxyz'])
    """)
    assert done.stdout.startswith('(0.0, -0.0, 0.5'), done.stderr
    assert 'True (0, 0, 0, 0)' in done.stdout


def test_what_tf2_kdl_takes_is_a_sentence_and_an_import_error(program):
    done = dropped_in(program, """
        try:
            import tf2_kdl
        except ImportError as error:
            print(error.name, error)
    """)
    assert done.stdout.startswith('tf2_kdl tf2_kdl is not installed'), done.stderr
    assert 'as_matrix(transform)' in done.stdout


@pytest.mark.parametrize('options', [(), ('--force',)])
@pytest.mark.parametrize('name', ['tf_transformations', 'tf2_kdl'])
def test_installed_one_is_used_also_where_ours_are_forced(program, tmp_path, name, options):
    installed = tmp_path / 'installed' / name
    installed.mkdir(parents=True)
    (installed / '__init__.py').write_text('from .part import where')
    (installed / 'part.py').write_text('where = __file__')
    done = dropped_in(program, f'import {name}; print({name}.where)', *options,
                      path=installed.parent)
    assert done.stdout.strip() == str(installed / 'part.py'), done.stderr
