# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compiled formulas return what their source does, to the last bit: scripts/test --compiled."""

from fractions import Fraction
from importlib.util import module_from_spec, spec_from_file_location
import math
from pathlib import Path
import struct

from hypothesis import given, strategies as st
import pytest
from tf_tree_py.core import COMPILED, Pose
from tf_tree_py.core.geometry import chain

pytestmark = pytest.mark.skipif(not COMPILED, reason='the formulas are not compiled')

floats = st.one_of(
    st.floats(), st.floats(-1.0, 1.0), st.sampled_from([
        0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 2.2e-308, 1.7976931348623157e308, 1e-15, -1e-15,
        1.0 - 2 ** -53, 1.0 + 2 ** -52, math.sqrt(0.5), math.inf, -math.inf, math.nan, -113.0]))
poses = st.tuples(*[floats] * 7)
quaternions = st.tuples(*[floats] * 4)
stamps = st.integers(-2 ** 63, 2 ** 63 - 1)


def unit(q):
    size = math.hypot(*q)
    return tuple(part / size for part in q) if 0.0 < size < math.inf else (0.0, 0.0, 0.0, 1.0)


rotations = quaternions.map(unit)
sound = st.builds(lambda t, q: (*t, *q), st.tuples(*[floats] * 3), rotations)


@pytest.fixture(scope='module')
def source():
    path = Path(chain.__file__).with_name('chain.py')
    module = module_from_spec(spec := spec_from_file_location('interpreted_chain', path))
    spec.loader.exec_module(module)
    return module


def outcome(function, *arguments):
    """Return the bits of a result, in which all NaNs are equal; or the class of the error."""
    try:
        numbers = function(*arguments)
    except Exception as error:
        return type(error)
    return struct.pack(f'{len(numbers)}d', *[
        math.nan if math.isnan(number) else number for number in numbers])


def assert_same(source, name, *arguments):
    assert outcome(getattr(chain, name), *arguments) == outcome(getattr(source, name), *arguments)


@given(st.lists(st.one_of(poses, sound), max_size=4), st.lists(sound, max_size=4))
def test_products(source, down, up):
    assert_same(source, 'join_branches', down, up)
    assert_same(source, 'compose_chain', down)


@given(st.one_of(poses, sound), st.one_of(poses, sound))
def test_products_of_two_and_inverses(source, a, b):
    assert_same(source, 'compose', a, b)
    assert_same(source, 'inverse', a)


@given(st.one_of(poses, sound), st.one_of(poses, sound), st.tuples(stamps, stamps, stamps))
def test_poses_between_samples(source, a, b, three):
    first, stamp, last = sorted(three)
    assert_same(source, 'between_samples', (*a, *b), stamp, first, last)


@given(sound, sound, stamps, st.integers(1, 2 ** 34), st.integers(0, 1000))
def test_poses_between_samples_of_a_robot(source, a, b, first, interval, part):
    stamp = first + interval * part // 1000
    assert_same(source, 'between_samples', (*a, *b), stamp, first, first + interval)


@given(floats, floats, st.booleans())
def test_weights(source, cosine, ratio, as_tf2):
    assert_same(source, 'slerp_weights', cosine, ratio, as_tf2)


@given(st.one_of(quaternions, rotations))
def test_matrices_of_tf2(source, q):
    assert_same(source, 'through_tf2_matrix', q)


@pytest.mark.parametrize(('name', 'arguments'), [
    ('inverse', (None,)), ('inverse', (('x',) * 7,)), ('compose', (chain.IDENTITY, None)),
    ('compose_chain', ([('x',) * 7] * 2,)), ('slerp_weights', ('x', 0.5, True)),
    ('between_samples', (None, 1, 0, 2)), ('through_tf2_matrix', ((0.0, 0.0, 0.0, 0.0),)),
    ('between_samples', (chain.IDENTITY * 2, 1, 5, 5)), ('inverse', ()),
])
def test_errors_are_of_the_same_class(source, name, arguments):
    found = outcome(getattr(chain, name), *arguments)
    assert isinstance(found, type) and issubclass(found, Exception)
    assert found is outcome(getattr(source, name), *arguments)


def test_integers_are_numbers(source):
    assert_same(source, 'compose', (1, 2, 3, 0, 0, 0, 1), (4, 5, 6, 0, 0, 0, 1))


@pytest.mark.parametrize('pose', [list(chain.IDENTITY), chain.IDENTITY[:6]])
def test_compiled_formulas_refuse_what_is_not_a_tuple_of_seven(pose):
    assert outcome(chain.compose, chain.IDENTITY, pose) is TypeError
    assert outcome(chain.compose_chain, [pose]) is TypeError
    assert outcome(chain.inverse, pose) is TypeError


def test_compiled_formulas_refuse_other_numbers_than_floats_and_integers():
    pose = Pose(*map(Fraction, chain.IDENTITY))
    assert outcome(pose.inverse) is TypeError
    assert outcome(pose.__matmul__, Pose()) is TypeError
    assert outcome(Pose(*map(float, pose)).inverse) == outcome(Pose().inverse)
