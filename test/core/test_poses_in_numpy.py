# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What numpy makes of poses is a plain array, or poses that compose as poses do.

Every function and method of numpy that takes an array gets poses, and the plain array of their
numbers, and has to return the same for both. There are seven poses, for which numpy's own product
also has the right shape.
"""

import copy
import io
import operator
import pickle

import numpy as np
import pytest
from strategies import random_poses
from tf_tree_py.core import Pose, Poses, se3

# Of functions that are deprecated, and of the logarithms of negative numbers.
pytestmark = pytest.mark.filterwarnings('ignore')

OTHER, POINT = Pose.from_xyz_rpy(0.2, -0.1, 0.8, 0.3, -0.5, 1.1), (1.0, 2.0, 3.0)

NUMBERS = random_poses(np.random.default_rng(4), 7)

# The arguments; each function gets all of them, and refuses most.
CALLS = [
    lambda p: (p,), lambda p: (p, 0), lambda p: (p, 1), lambda p: (p, 1, 0), lambda p: (p, 0, 1),
    lambda p: (p, -1, 0), lambda p: (p, 7), lambda p: (p, (7, 7)), lambda p: (p, (7, 7, 7)),
    lambda p: (p, (1, 0)), lambda p: (p, [2, 0], 0), lambda p: (p, [True] * 7, 0),
    lambda p: (p, 0, 0.5, 0), lambda p: (p, float), lambda p: (p, float, 0),
    lambda p: (p, p), lambda p: (p, p, p + 0.0), lambda p: (p, p[0]), lambda p: (p[0],),
    lambda p: (p[0], p[0]), lambda p: (p[0], p[0], p[0] + 0.0), lambda p: (p[0], 2),
    lambda p: (p[0], p[0], 2), lambda p: ([p, p],), lambda p: ([p, p], 1), lambda p: (p > 0, p),
    lambda p: ([True] * 7, p, 0), lambda p: (p > 0, p, 0.0), lambda p: ([p > 0], [p]),
    lambda p: (p, [p > 0], [1.0]), lambda p: ([0] * 7, p), lambda p: (p, [[0] * 7], 0),
    lambda p: (p, [[0] * 7], [[1.0] * 7], 0), lambda p: ('ij,jk', p, p),
    lambda p: (np.sort, 0, p), lambda p: (np.sum, p, [0]),
    lambda p: (p[0], [0.0, 1.0], [2.0, 3.0]),
    lambda p: (p, np.zeros((7, 7), int)), lambda p: (p, np.zeros((7, 7), int), 0),
    lambda p: (-1, p), lambda p: (p, 1.0, float), lambda p: (p, 'cpu'),
]

# Those that make an array of anything; numpy does not dispatch them.
MAKERS = ('array', 'asarray', 'asanyarray', 'ascontiguousarray', 'asfortranarray', 'asmatrix',
          'asarray_chkfinite', 'from_dlpack', 'require')

# Functions that do not return for poses what they return for an array.
EXCLUDED = {
    'numpy.array_repr': 'says Poses',
    'numpy.astype': 'requires an ndarray',
    'numpy.copyto': 'requires an ndarray',
    'numpy.empty_like': 'returns any numbers',
    'numpy.histogramdd': 'makes ten million bins',
    'numpy.linalg.matmul': 'is the product of poses',
    'numpy.matmul': 'is the product of poses',
    'numpy.piecewise': 'requires that conditions are ndarrays',
    'numpy.place': 'requires an ndarray',
    'numpy.putmask': 'requires an ndarray',
    'numpy.save': 'writes a file',
    'numpy.savetxt': 'writes a file',
    'numpy.savez': 'writes a file',
    'numpy.savez_compressed': 'writes a file',
}
EXCLUDED_METHODS = {
    'conj': 'its out has to be an ndarray',
    'conjugate': 'its out has to be an ndarray',
    'dump': 'writes a file',
    'resize': 'would leave poses of another shape',
    'setflags': 'crashes for some arguments, also of an array',
    'tofile': 'writes a file',
}
# What Python and numpy look up themselves.
EXCLUDED_PROTOCOLS = {
    '__array_finalize__': 'of subclasses',
    '__array_function__': 'without it, functions convert to arrays',
    '__array_interface__': 'there is __array__',
    '__array_namespace__': 'of the array API, for which poses are no array',
    '__array_prepare__': 'of subclasses',
    '__array_priority__': 'there is __array_ufunc__',
    '__array_struct__': 'there is __array__',
    '__array_wrap__': 'without it, results are plain',
    '__buffer__': 'only Python 3.12 has it: poses.data is the buffer',
    '__class_getitem__': 'of types',
    '__complex__': 'seven numbers are not one',
    '__deepcopy__': 'there is __reduce__',
    '__delitem__': 'arrays refuse it',
    '__float__': 'seven numbers are not one',
    '__index__': 'seven numbers are not one',
    '__int__': 'seven numbers are not one',
    '__setstate__': 'there is __reduce__',
}


def functions():
    """Return all functions of numpy that take an array, by name."""
    found = {f'numpy.{name}': getattr(np, name) for name in MAKERS}
    for module in (np, np.linalg, np.fft):
        for name in dir(module):
            function = getattr(module, name)
            if hasattr(function, '_implementation') or isinstance(function, np.ufunc):
                found[f'{module.__name__}.{name}'] = function
    return found


@pytest.fixture(scope='module')
def file_of_poses(tmp_path_factory):
    path = tmp_path_factory.mktemp('poses') / 'poses'
    NUMBERS.tofile(path)
    return path


def made():
    """Return seven poses in memory of their own."""
    return Poses(NUMBERS.copy())


@pytest.fixture
def makers(file_of_poses):
    """Return functions that return the same poses, of each origin."""
    return [made, lambda: Poses(np.memmap(file_of_poses, float, 'c', shape=(7, 7))),
            lambda: pickle.loads(pickle.dumps(made()))]


def behaves(poses):
    """Poses compose and invert as the formulas do."""
    array = np.asarray(poses)
    assert isinstance(poses @ OTHER, Poses | Pose)
    for ours, formula in (
            (poses @ OTHER, se3.compose_many(array, np.array(OTHER))),
            (OTHER @ poses, se3.compose_many(np.array(OTHER), array)),
            (poses @ POINT, se3.apply_many(array, POINT)),
            (poses.inverse(), se3.inverse_many(array)),
            (poses.translation, array[..., :3])):
        np.testing.assert_allclose(ours, formula, rtol=1e-14, atol=1e-14)


def same(ours, plain):
    """Two results have the same type and numbers, except that one may be poses."""
    if isinstance(ours, Poses):
        behaves(ours)
        ours = np.asarray(ours)
    assert type(ours) is type(plain)
    if isinstance(plain, tuple | list):
        assert len(ours) == len(plain)
        for part, other in zip(ours, plain, strict=True):
            same(part, other)
    elif isinstance(plain, np.ndarray | np.generic | int | float | str | bytes | np.dtype):
        np.testing.assert_equal(ours, plain)


def outcome(function, arguments):
    """Return the result, and whether there is one."""
    try:
        return function(*arguments), True
    except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError, RuntimeError):
        return None, False


def answers_as_an_array(makers, call):
    """Call with poses and with arrays, and return how often there was an answer."""
    answers = 0
    for make in makers:
        for arguments in CALLS:
            poses, plain = make(), NUMBERS.copy().view()
            ours, answered = outcome(call, arguments(poses))
            theirs, has_answer = outcome(call, arguments(plain))
            assert answered or not has_answer, arguments(plain)
            if has_answer:
                same(ours, theirs)
                np.testing.assert_array_equal(poses, plain)  # if it was changed in place
            elif isinstance(ours, Poses):
                behaves(ours)
            answers += has_answer
    return answers


@pytest.mark.parametrize('name', sorted(functions().keys() - EXCLUDED.keys()))
def test_function_of_numpy_takes_poses_for_an_array(name):
    answers_as_an_array([made], functions()[name])


def test_usual_functions_of_numpy_do_answer():
    """A function that refused all arguments would pass."""
    names = ('take roll reshape repeat compress delete swapaxes concatenate stack insert append '
             'tile flip sort where select choose take_along_axis put fill_diagonal einsum dot '
             'average interp apply_along_axis broadcast_to expand_dims array_split '
             'transpose pad add arctan2 asarray full_like')
    for name in names.split():
        assert answers_as_an_array([made], functions()[f'numpy.{name}']), name
    assert len(functions()) > 280


@pytest.mark.parametrize('name', [name for name in dir(np.ndarray)
                                  if not name.startswith('_') and name not in EXCLUDED_METHODS])
def test_method_of_an_array_is_that_of_poses(makers, name):
    """A name of a new numpy passes, or needs arguments in ``CALLS`` or a reason to exclude it."""
    def call(array, *others):
        member = getattr(array, name)
        return member(*others) if callable(member) else member
    assert answers_as_an_array(makers, call)


def test_protocols_of_an_array_are_those_of_poses_or_excluded():
    ours, theirs = set(dir(Poses)), set(dir(np.ndarray))
    assert {name for name in theirs - ours if name.startswith('__')} <= EXCLUDED_PROTOCOLS.keys()
    assert not ours & EXCLUDED_PROTOCOLS.keys()


# --- products

ON_THE_RIGHT = [OTHER, made(), NUMBERS, OTHER.as_matrix(), made()[3]]


@pytest.mark.parametrize('right', ON_THE_RIGHT, ids=type)
def test_every_way_to_multiply_is_the_product_of_poses(right):
    expected = made() @ right
    behaves(expected)
    place, plain = made(), np.zeros((7, 7))
    for product in (np.matmul(made(), right), np.matmul(made(), right, out=place), place,
                    np.matmul(made(), right, out=plain), plain):
        np.testing.assert_array_equal(product, expected)
    poses = made()
    assert operator.imatmul(poses, right) is poses
    np.testing.assert_array_equal(poses, expected)


def test_array_that_is_multiplied_in_place_is_not_multiplied_by_numpy():
    for right in (OTHER, made()):
        array = NUMBERS.copy()
        assert operator.imatmul(array, right) is array
        np.testing.assert_array_equal(array, NUMBERS @ right)
        np.testing.assert_array_equal(array, made() @ right)


@pytest.mark.parametrize('multiply', [
    lambda: np.matmul(made(), made(), dtype=float),
    lambda: np.matmul(made(), made(), axes=[(-1, -2)] * 3),
    lambda: np.matmul(OTHER, np.eye(7), out=Pose()),
    lambda: np.add(made()[0], 1.0, out=Pose()),
])
def test_what_would_be_a_product_of_numpy_or_be_lost_is_refused(multiply):
    with pytest.raises(TypeError, match=r'has no option but out|never changes: pass an array'):
        multiply()


def test_arrays_are_not_multiplied_into_poses_by_numpy():
    with pytest.raises(ValueError, match=r'left operand of @ must be poses'):
        np.matmul(np.eye(5), NUMBERS[:5], out=Poses(np.zeros((5, 7))))
    with pytest.raises(ValueError, match='broadcast'):
        operator.imatmul(made(), np.ones((7, 3)))


# --- operators

OPERATORS = [operator.add, operator.sub, operator.mul, operator.truediv, operator.floordiv,
             operator.mod, operator.pow, divmod, operator.lt, operator.le, operator.gt,
             operator.ge, operator.eq, operator.ne]


@pytest.mark.parametrize('apply', OPERATORS)
def test_operators_are_those_of_arrays_on_either_side(apply):
    for other in (2.0, 2, np.float64(2.0), np.float32(2.0), np.int64(2), np.bool_(True),
                  NUMBERS[0], NUMBERS, NUMBERS.tolist(), OTHER, made(), made()[0]):
        plain = np.asarray(other)
        same(apply(made(), other), apply(NUMBERS, plain))
        same(apply(other, made()), apply(plain, NUMBERS))


@pytest.mark.parametrize('apply', [
    operator.iadd, operator.isub, operator.imul, operator.itruediv, operator.ifloordiv,
    operator.imod])
def test_poses_that_are_changed_in_place_stay_poses_in_the_same_memory(apply):
    array, plain = NUMBERS.copy(), NUMBERS.copy()
    poses = Poses(array)
    assert apply(poses, OTHER) is poses
    apply(plain, np.array(OTHER))
    np.testing.assert_array_equal(array, plain)
    behaves(poses)


def test_results_go_into_given_memory():
    first, second = np.modf(made(), out=(None, place := made()))
    assert type(first) is np.ndarray
    assert second is place
    np.testing.assert_array_equal(place, np.trunc(NUMBERS))


def test_poses_compare_with_what_is_no_number_as_arrays_do():
    for other in (None, 'map'):
        assert not (made() == other).any()
        assert (made() != other).all()
    assert 0.1234 not in made()
    assert NUMBERS[2, 4] in made()


def test_poses_have_no_truth_value_and_no_hash():
    for poses in (made(), made()[:0], made()[0]):
        with pytest.raises(TypeError, match=r'Poses has no truth value.*None.*len\(\)'):
            bool(poses)
    with pytest.raises(TypeError, match='unhashable'):
        hash(made())


# --- memory

def test_memory_is_shared_and_keeps_its_owner(file_of_poses):
    mapped = np.memmap(file_of_poses, float, 'r', shape=(7, 7))
    for array in (NUMBERS.copy(), mapped):
        poses = Poses(array)
        for other in (np.asarray(poses), np.array(poses, copy=False), np.asanyarray(poses),
                      Poses(poses), poses[2:], poses.translation, poses.T, next(iter(poses))):
            assert np.shares_memory(other, array)
        assert not np.shares_memory(np.array(poses), array)
    with pytest.raises(ValueError, match='read-only'):
        poses[0] = 1.0
    with pytest.raises(ValueError, match='read-only'):
        poses += 1.0
    assert np.asarray(poses, np.float32).dtype == np.float32
    assert np.from_dlpack(made()).dtype == np.float64


# Skipped where numpy is old, so this file runs in the environment of a newer numpy, too, whose
# functions have other names.
@pytest.mark.skipif(int(np.__version__.partition('.')[0]) < 2,
                    reason='np.asarray has no copy before numpy 2')
def test_memory_is_copied_only_where_numpy_asks_for_it():
    poses = made()
    assert np.shares_memory(np.asarray(poses, copy=False), poses.translation)
    assert not np.shares_memory(np.asarray(poses, copy=True), poses.translation)
    with pytest.raises(ValueError, match='copy'):
        np.asarray(poses, np.float32, copy=False)


def test_poses_keep_their_shape():
    array = np.zeros((2, 7))
    poses = Poses(array)
    for resize in (lambda: poses.resize((7, 2)), lambda: setattr(poses, 'shape', (7, 2)),
                   lambda: setattr(array, 'shape', (7, 2)),
                   lambda: setattr(np.asarray(poses), 'shape', (7, 2))):
        outcome(resize, ())
        assert poses.shape == (2, 7)


@pytest.mark.parametrize('copied', [
    Poses.copy, copy.copy, copy.deepcopy,
    *(lambda poses, protocol=protocol: pickle.loads(pickle.dumps(poses, protocol))
      for protocol in range(pickle.HIGHEST_PROTOCOL + 1))])
def test_copies_are_poses_with_memory_of_their_own(copied):
    poses = made()
    other = copied(poses)
    behaves(other)
    other += 1.0
    np.testing.assert_array_equal(poses, NUMBERS)
    np.testing.assert_array_equal(other, NUMBERS + 1.0)


def test_poses_are_written_into_files_as_arrays():
    for write in (np.save, np.savez, np.savez_compressed):
        write(file := io.BytesIO(), made())
        file.seek(0)
        found = np.load(file)
        np.testing.assert_array_equal(found if write is np.save else found['arr_0'], NUMBERS)
    np.savetxt(file := io.BytesIO(), made())
    assert np.loadtxt(file.getvalue().decode().splitlines()) == pytest.approx(NUMBERS)


def test_poses_that_numpy_would_shuffle_wrongly_cause_its_warning():
    with pytest.warns(UserWarning, match="shuffling a 'Poses' object"):
        np.random.default_rng(0).shuffle(made())
    assert sorted(np.random.default_rng(0).permutation(made())[:, 0]) == sorted(NUMBERS[:, 0])


# --- names

def test_poses_say_what_they_are_and_show_their_numbers():
    assert repr(Poses([Pose(1.0), Pose(0.5)])) == (
        'Poses([[1. , 0. , 0. , 0. , 0. , 0. , 1. ],\n'
        '       [0.5, 0. , 0. , 0. , 0. , 0. , 1. ]])')


def test_names_that_neither_poses_nor_arrays_have_are_refused():
    with pytest.raises(AttributeError, match=r"'Poses' object has no attribute 'position'"):
        made().position  # noqa: B018
    with pytest.raises(AttributeError):
        made().position = 1.0
    assert not hasattr(made(), '__array_interface__')
