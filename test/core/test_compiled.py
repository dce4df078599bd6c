# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The pose along a path in C is that of Python, to the last bit; also under sanitizers.

Only the package itself, pytest and hypothesis are needed here: the wheels of a release run this.
"""

from array import array
import gc
import math
import random
import struct
import sys

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from tf_tree_py.core import (
    COMPILED,
    Interpolation,
    Linear,
    PastExtrapolationException,
    PlainBuffer,
    Pose,
    tree,
    UNLIMITED,
)
from tf_tree_py.core.edges.packed import Columns
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry.chain import IDENTITY, join_branches
from tf_tree_py.core.tree import path as paths

pytestmark = pytest.mark.skipif(not COMPILED, reason='the formulas are not compiled')
if COMPILED:
    from tf_tree_py.core.tree import path_in_c

ODD = [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 2.2e-308, 1.7976931348623157e308, 1e-15, -1e-15,
       1e-16, 1.0 - 2 ** -53, 1.0 + 2 ** -52, math.sqrt(0.5), math.inf, -math.inf, math.nan,
       -113.0]
STARTS = [0, 1, -7, 1_700_000_000_000_000_000, -2 ** 63, 2 ** 63 - 40, 2 ** 53]
STEPS = [0, 1, 2, 3, 10_000_000, 10_000_000, 10_000_000, 2 ** 53 + 1, 2 ** 61, -1, -5]

# The slots of a moving edge that C reads.
READ = {'stamps', 'poses', 'parents', '_horizon', '_is_linear'}

numbers = st.one_of(st.floats(), st.floats(-1.0, 1.0), st.sampled_from(ODD))
numbers_of_poses = st.tuples(*[numbers] * 7)


def rotation(drawn):
    """Return a unit quaternion, often half a turn or nearly nothing from another."""
    q = [drawn.gauss(0.0, 1.0) for _ in range(4)]
    kind = drawn.randrange(6)
    if kind == 0:
        q = [0.0] * 4
        q[drawn.randrange(4)] = drawn.choice([1.0, -1.0])
    elif kind == 1:
        q = [1e-9 * part for part in q[:3]] + [drawn.choice([1.0, -1.0])]
    size = math.hypot(*q) or 1.0
    return [part / size for part in q]


def pose(drawn, odd=0.1):
    if drawn.random() < odd:
        return tuple(drawn.choice(ODD) for _ in range(7))
    return (*(drawn.uniform(-9.0, 9.0) for _ in range(3)), *rotation(drawn))


class Wavy(Interpolation):
    """An interpolation of a user, which Python computes."""

    def between(self, samples, index, stamp):
        return Pose.from_xyz_rpy(x=stamp % 7, yaw=0.1 * (stamp % 11))


class Held(Linear):
    holds_for = 3


class Raising(Interpolation):

    def between(self, samples, index, stamp):
        raise ArithmeticError(stamp)


def moving(drawn):
    """Return a history that is filled by the methods of a tree."""
    history = Samples('b', drawn.choice([0, 5, 30_000_000, UNLIMITED, UNLIMITED]))
    stamp, parent = drawn.choice(STARTS), 'a'
    for _ in range(drawn.randrange(12)):
        stamp = min(max(stamp + drawn.choice(STEPS), -2 ** 63), 2 ** 63 - 1)
        if drawn.random() < 0.02:
            parent = drawn.choice('ac')
        if drawn.random() < 0.02:
            history.end()
        sample = pose(drawn)
        if drawn.random() > 0.3 or not history.append(stamp, struct.pack('7d', *sample)):
            history.insert(stamp, parent, sample)
    if drawn.random() < 0.1:
        history.interpolate_by(drawn.choice([Wavy(), Held(), Raising()]))
    if len(history) and drawn.random() < 0.1:
        history.set_poses(np.array([pose(drawn) for _ in range(len(history))]))
    return history


def in_file(drawn):
    """Return a history that uses the memory of a file, whose content is anything."""
    count = drawn.randrange(6)
    stamps = [drawn.choice(STARTS) + drawn.choice([0, 1, 5, 20]) for _ in range(count)]
    if drawn.random() < 0.5:
        stamps.sort()
    poses = [number for _ in range(count) for number in pose(drawn, 0.3)]
    poses = poses[:len(poses) - drawn.choice([0, 0, 0, 1, 7])] if poses else poses
    memory = [bytes(drawn.choice([0, 8, 3])) + array(code, column).tobytes()
              for code, column in (('q', stamps), ('d', poses))]
    aligned = [memoryview(part)[len(part) % 8:].cast(code)
               for part, code in zip(memory, 'qd', strict=True)]
    history = Samples('b', 10)
    history.lie_on(Columns(*aligned, None, ()), 'a')
    return history


def static(drawn):
    return StaticHistory('b', 'a', pose(drawn))


def edge(drawn):
    """Return an edge, or a pose, which a caller may have in place of an edge."""
    make = drawn.choice([moving] * 5 + [in_file, static, pose])
    return make(drawn)


def stamps_near(drawn, edges):
    """Return stamps at, between and beside samples, and far away."""
    known = [stamp for one in edges if isinstance(one, Samples) for stamp in one.stamps]
    known = 4 * known + [0, -2 ** 63, 2 ** 63 - 1, 2 ** 63, 2 ** 64, -2 ** 63 - 1]
    return [drawn.choice(known) + drawn.choice([0, 0, 1, -1, 2, -1_000, -3_333_333])
            for _ in range(8)]


def outcome(function, *arguments):
    """Return the bits of a pose, in which all NaNs are equal; or the error."""
    try:
        found = function(*arguments)
    except Exception as error:
        return type(error), str(error)
    assert type(found) is tuple, found
    return struct.pack('7d', *[math.nan if math.isnan(one) else one for one in found])


def in_python(down, up, stamp):
    down, up = ([one if type(one) is tuple else one.sample(stamp) for one in branch]
                for branch in (down, up))
    return tuple(map(float, join_branches(down, up)))


def in_c(down, up, stamp):
    found = paths.pose_in_c(down, up, stamp)
    return in_python(down, up, stamp) if found is None else found


def compare(drawn):
    """Compare answers over one path; return how many of them are C's."""
    edges = tuple(edge(drawn) for _ in range(drawn.choice([1, 1, 1, 2, 4])))
    down, up = edges[:(cut := drawn.randrange(len(edges) + 1))], edges[cut:]
    of_c = 0
    for stamp in stamps_near(drawn, edges):
        # First, because Python skips what has expired when it searches.
        found = outcome(in_c, down, up, stamp)
        assert found == outcome(in_python, down, up, stamp), (down, up, stamp)
        of_c += isinstance(found, bytes) and paths.pose_in_c(down, up, stamp) is not None
    return of_c


@given(st.randoms(use_true_random=False))
def test_answers_and_errors_over_any_path(drawn):
    compare(drawn)


def test_thousands_of_answers():
    drawn = random.Random(68)
    assert sum(compare(drawn) for _ in range(2500)) > 5000


@given(numbers_of_poses, numbers_of_poses, st.integers(-2 ** 63, 2 ** 63 - 1),
       st.integers(-2 ** 63, 2 ** 63 - 1), st.integers(-2 ** 63, 2 ** 63 - 1))
@settings(max_examples=5 * settings().max_examples)
def test_poses_between_two_samples_of_any_numbers(a, b, first, stamp, last):
    first, stamp, last = sorted((first, stamp, last))
    history = Samples('b', UNLIMITED)
    history.insert(first, 'a', a)
    history.insert(last, 'a', b)
    assert outcome(in_c, (history,), (), stamp) == outcome(in_python, (history,), (), stamp)
    assert outcome(in_c, (), (history,), stamp) == outcome(in_python, (), (history,), stamp)


@given(st.lists(numbers_of_poses, max_size=4), st.lists(numbers_of_poses, max_size=4))
@settings(max_examples=5 * settings().max_examples)
def test_products_of_any_numbers(down, up):
    down, up = ([StaticHistory('b', 'a', pose) for pose in poses] for poses in (down, up))
    assert outcome(in_c, tuple(down), tuple(up), 1) == outcome(in_python, down, up, 1)


# --- what C leaves to Python, and what it does not

def two_samples(*, at=(10, 20), poses=((1.0, *IDENTITY[1:]), (2.0, *IDENTITY[1:]))):
    history = Samples('b', 100)
    for stamp, sample in zip(at, poses, strict=True):
        history.insert(stamp, 'a', sample)
    return history


@pytest.mark.parametrize(('stamp', 'x'), [(10, 1.0), (11, 1.1), (19, 1.9), (20, 2.0)])
def test_common_lookups_call_no_python(stamp, x, monkeypatch):
    monkeypatch.setattr(Samples, 'sample', None)
    assert paths.pose_in_c((two_samples(),), (), stamp) == (x, *IDENTITY[1:])


def test_half_a_turn_is_left_to_python():
    history = two_samples(poses=((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
                                 (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)))
    assert paths.pose_in_c((history,), (), 15) == history.sample(15)


@pytest.mark.parametrize('number', [1, True, np.float64(1.0), '1', None])
def test_poses_of_other_numbers_are_left_to_python(number):
    pose = (number, *IDENTITY[1:])
    for part in pose, StaticHistory('b', 'a', pose):
        assert paths.pose_in_c((part,), (), 1) is None
        assert paths.pose_in_c((), (part,), 1) is None


@pytest.mark.parametrize('sampled', [[0.0] * 7, (0.0,) * 6, (0.0,) * 8, None, 'seven'])
def test_what_is_no_pose_is_left_to_python(sampled):
    class Other:

        def sample(self, stamp):
            return sampled

    assert paths.pose_in_c((Other(),), (), 1) is None
    assert paths.pose_in_c((two_samples(),), (Other(),), 15) is None


@pytest.mark.parametrize(('name', 'value'), [
    *(('_horizon', stamp) for stamp in (10, 11, 20, 2 ** 70, -2 ** 70, None)),
    ('_is_linear', 1), ('_is_linear', None), ('parents', ['a', 'a']), ('parents', ['a', 'b']),
    ('stamps', [10, 20]), ('stamps', array('q')), ('stamps', array('q', [10])), ('stamps', None),
    ('poses', [1.0] * 14), ('poses', array('d')), ('poses', array('d', [1.0] * 13)),
    ('poses', array('d', [1.0] * 21)), ('poses', None)])
def test_slots_of_any_content(name, value):
    for stamp in 10, 15, 20:
        history, other = two_samples(), two_samples()
        for one in history, other:
            setattr(one, name, value)
        assert outcome(in_c, (history,), (), stamp) == outcome(in_python, (other,), (), stamp)


def test_what_has_expired_is_not_found():
    history = Samples('b', 30)
    for stamp in range(10, 101, 10):
        history.insert(stamp, 'a', IDENTITY)
    # The window ends at the newest stamp before the last sample, 90.
    for stamp in 10, 45, 59:
        with pytest.raises(PastExtrapolationException):
            paths.pose_in_c((history,), (), stamp)
    assert paths.pose_in_c((history,), (), 60) == paths.pose_in_c((history,), (), 61) == IDENTITY


def test_classes_that_inherit_have_their_own_samples():
    class Still(StaticHistory):

        def sample(self, stamp):
            return (float(stamp), *IDENTITY[1:])

    class Moving(Samples):

        def sample(self, stamp):
            return (float(stamp), *IDENTITY[1:])

    moving = Moving('b', 100)
    for stamp in 10, 20:
        moving.insert(stamp, 'a', IDENTITY)
    for edge in moving, Still('b', 'a', IDENTITY):
        assert paths.pose_in_c((edge,), (), 15) == (15.0, *IDENTITY[1:])


@pytest.mark.skipif(sys.version_info < (3, 12), reason='needs buffers of classes in Python')
@pytest.mark.parametrize('dropped', ['stamps', 'poses'])
def test_buffer_that_drops_the_memory_while_it_is_asked_for(dropped):
    class Dropping:

        def __buffer__(self, flags):
            delattr(history, dropped)
            return memoryview(bytes(16))

    history = two_samples()
    history.stamps = Dropping()
    with pytest.raises((AttributeError, TypeError)):
        paths.pose_in_c((history,), (), 15)


def test_slots_without_a_value_are_left_to_python():
    still, moving = StaticHistory('b', 'a', IDENTITY), two_samples()
    del still.pose
    assert paths.pose_in_c((still,), (), 15) is None
    for name in sorted(READ):
        moving = two_samples()
        delattr(moving, name)
        with pytest.raises(AttributeError, match=name):
            paths.pose_in_c((moving,), (), 15)


def test_stamps_that_are_no_integers_of_64_bits_are_left_to_python():
    for stamp in 2 ** 63, -2 ** 63 - 1, 15.0, np.int64(15), True, None:
        assert paths.pose_in_c((two_samples(),), (), stamp) is None


def test_errors_of_an_edge_come_from_its_own_method():
    class Refusing:

        def sample(self, stamp):
            raise OSError(stamp)

    for path in ((Refusing(),), ()), ((two_samples(),), (two_samples(), Refusing())):
        with pytest.raises(OSError, match='15'):
            paths.pose_in_c(*path, 15)
    with pytest.raises(AttributeError):
        paths.pose_in_c((object(),), (), 15)


@pytest.mark.parametrize('arguments', [
    (), ((), ()), ((), (), 1, 2), ([], (), 1), ((), [], 1), (None, None, None)])
def test_other_arguments_are_errors(arguments):
    with pytest.raises(TypeError, match='two tuples'):
        paths.pose_in_c(*arguments)


def test_empty_branches_are_the_identity():
    assert paths.pose_in_c((), (), 5) == IDENTITY


# --- memory

def test_nothing_is_kept():
    """Neither references, nor views of the arrays, which could not grow then."""
    history, still, stamp = two_samples(), StaticHistory('c', 'b', IDENTITY), 10 ** 15
    waving = two_samples()
    waving.interpolate_by(Wavy())
    lookups = [((history, still), (still,), 15), ((history,), (), stamp), ((still,), (None,), 15),
               ((waving, history), (waving, IDENTITY), 15)]
    counts = [sys.getrefcount(one) for one in (history, still, waving, stamp)]
    gc.collect()
    blocks = sys.getallocatedblocks()
    for _ in range(2000):
        for lookup in lookups:
            outcome(in_c, *lookup)
    assert [sys.getrefcount(one) for one in (history, still, waving, stamp)] == counts
    gc.collect()
    assert sys.getallocatedblocks() - blocks < 500
    assert history.insert(30, 'a', IDENTITY)


def test_an_interpolation_may_change_the_history_that_is_read():
    class Appending(Interpolation):

        def between(self, samples, index, stamp):
            for _ in range(1000):
                samples.insert(samples.newest_stamp + 1, 'a', IDENTITY)
            samples.clear()
            other.clear()
            return IDENTITY

    history, other = two_samples(), two_samples()
    history.interpolate_by(Appending())
    assert paths.pose_in_c((other, history), (), 15) == (1.5, *IDENTITY[1:])
    assert len(other) == 0


# --- a tree

def test_lookups_of_a_buffer_use_it(monkeypatch):
    buffer = PlainBuffer()
    buffer.insert('a', 'b', 10, Pose(x=1.0))
    buffer.insert('a', 'b', 20, Pose(x=2.0))
    buffer.insert('a', 'c', 0, Pose(y=1.0), static=True)
    monkeypatch.setattr(Samples, 'sample', None)
    assert buffer.lookup('c', 'b', 15) == Pose(x=1.5, y=-1.0)
    assert buffer.lookup('c', 'b') == Pose(x=2.0, y=-1.0)
    assert buffer.lookup_tree('a', 15) == {'a': Pose(), 'b': Pose(x=1.5), 'c': Pose(y=1.0)}


# --- loading it

@pytest.mark.parametrize('name', ['pose', *sorted(READ)])
def test_slots_that_are_read_are_looked_for(name, monkeypatch):
    still = type('StaticHistory', (), {'__slots__': {'pose'} - {name}})
    moving = type('Samples', (), {'__slots__': READ - {name}})
    with pytest.raises(AttributeError, match=name):
        path_in_c.use(still, moving, 1)
    setattr(still if name == 'pose' else moving, name, property())
    with pytest.raises(TypeError, match=f'{name} is no slot'):
        path_in_c.use(still, moving, 1)
    monkeypatch.setattr(Samples, 'sample', None)  # the slots found before are those in use
    assert paths.pose_in_c((two_samples(),), (), 15) == (1.5, *IDENTITY[1:])


def test_other_classes_and_other_revisions_are_refused():
    moving = type('Samples', (), {'__slots__': READ})
    with pytest.raises(TypeError, match='other classes use it'):
        path_in_c.use(StaticHistory, moving, 1)
    with pytest.raises(TypeError, match='revision 1, not 7'):
        path_in_c.use(StaticHistory, Samples, 7)


class Built:
    """A built file that does not fit the sources."""

    def __init__(self, pose_at=paths.pose_in_c, use=lambda *_: None):
        self.pose_at, self.use = pose_at, use


def not_fitting(*_):
    raise TypeError('Samples.stamps is no slot')


@pytest.mark.parametrize(('built', 'why'), [
    (Built(use=not_fitting), 'Samples.stamps is no slot'),
    (Built(lambda *_: IDENTITY), 'they return other numbers than Python'),
    (Built(lambda *path: paths.pose_in_c(*path) if path[-1] < 21 else None),
     'they return other numbers than Python'),
    (object(), "'object' object has no attribute 'use'")])
def test_a_file_that_does_not_fit_is_not_used_and_one_warning_says_so(built, why, monkeypatch):
    monkeypatch.setattr(tree, 'path_in_c', built)
    with pytest.warns(RuntimeWarning) as warnings:
        assert paths.load_pose_in_c() is None
    assert [str(warning.message) for warning in warnings] == [
        f'lookups run in Python, because the compiled formulas do not fit ({why}): '
        'install tf_tree_py again, or set TF_TREE_PY_PURE=1']


@pytest.mark.parametrize(('value', 'is_pure'), [('1', True), ('yes', True), ('0', False),
                                                ('', False)])
def test_variable_chooses_python(value, is_pure, monkeypatch):
    monkeypatch.setenv('TF_TREE_PY_PURE', value)
    assert (paths.load_pose_in_c() is None) == is_pure
