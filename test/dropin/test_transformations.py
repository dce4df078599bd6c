# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``tf_transformations`` and ``tf2_kdl``, which programs import together with tf2_ros."""

from itertools import product
import math

from dropin_helpers import run
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tf_tree_py.dropin import transformations as ours

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
    with pytest.raises(ValueError, match='does not support spin here'):
        ours.quaternion_slerp(first, last, 0.5, spin=1)


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
    with pytest.raises(ValueError, match='is not a sequence such as sxyz or rzyx'):
        ours.euler_matrix(0, 0, 0, axes)


def dropped_in(program, code, *options, **folders):
    return run('-m', 'tf_tree_py.dropin', *options, program(code), **folders)


def test_program_imports_it_beside_tf2_ros(program):
    done = dropped_in(program, """
        from tf_transformations import *
        import tf_transformations, tf2_ros
        print(euler_from_quaternion(quaternion_from_euler(0.0, 0.0, 0.5)))
        try:
            tf_transformations.clip_matrix
        except AttributeError as error:
            print(error)
    """)
    assert done.stdout.startswith('(0.0, 0.0, 0.5'), done.stderr
    assert "has no 'clip_matrix': it has rotations" in done.stdout


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
