# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A warning is at the line that calls the package, whichever method it calls."""

import ast
from concurrent.futures import ThreadPoolExecutor
from functools import partial
import threading
import warnings

import house
import numpy as np
import pytest
from tf_tree_py import BufferCore, ConstantTwist, load, SplineFitter, trajectory, UNLIMITED
from tf_tree_py.core import PlainBuffer, Pose, Sample, TransformWarning
from tf_tree_py.core.buffer.waiting import WallDeadline
from tf_tree_py.core.errors import warn
from tf_tree_py.core.messages.observers import Observer
from warned_lines import assert_warns_at_its_line

SECOND = 10**9
NAN = Pose(float('nan'))
CURVE = ConstantTwist(0, SECOND, Pose(), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
LONG = np.arange(1, 21) * SECOND

INSERTIONS = {
    'insert': lambda made: made.insert('map', 'base', 1, NAN),
    'insert static': lambda made: made.insert('map', 'base', 1, NAN, static=True),
    'insert_many': lambda made: made.insert_many([Sample('map', 'base', 1, NAN)]),
    'insert_track': lambda made: made.insert_track('map', 'base', [1], [NAN]),
    'insert_track, dropped': lambda made: made.insert_track('map', 'base', LONG, [Pose()] * 20),
}
MORE_INSERTIONS = {
    'covariance': lambda made: made.insert('map', 'base', 1, NAN, covariance=np.eye(6)),
    'insert_curve': lambda made: made.insert_curve('base', 'base', CURVE),
    'in a query': lambda made: made.wait_for(lambda: made.insert('map', 'base', 1, NAN), NOW),
}
CACHES = {
    'PlainBuffer': lambda: PlainBuffer(10),
    'BufferCore': lambda: BufferCore(10),
    'by name': lambda: BufferCore(cache_time=10),
    'SplineFitter': lambda: SplineFitter(1.0, cache_time=10),
}
NOW = WallDeadline(0.0)
SECONDS = [2, 3]
MASKED = np.ma.array(SECONDS, mask=[False, True])
LOOKUPS = {
    'lookup_many': lambda tree: tree.lookup_many('map', 'base', SECONDS, outside='mask'),
    'masked stamps': lambda tree: tree.lookup_many('map', 'base', MASKED, 'mask'),
    'trajectory': lambda tree: trajectory(tree, 'map', 'base', SECONDS),
}


class Watches(Observer):

    def asked(self, target, source, stamp):
        return lambda error: None


class OwnBuffer(BufferCore):
    """A user's class, with a method between the caller and the package."""

    def __init__(self, cache_time=None):
        super().__init__(cache_time)

    def feed(self, pose):
        self.insert('map', 'base', 1, pose)


def fed(make=BufferCore):
    buffer = make(UNLIMITED)
    buffer.insert_track('map', 'base', LONG, [Pose()] * 20)
    return buffer


def watched():
    buffer = fed()
    buffer.observers.add(Watches())
    return buffer


@pytest.mark.parametrize('name', CACHES)
def test_short_window_is_warned_of_where_it_is_given(name):
    assert_warns_at_its_line(CACHES[name])


@pytest.mark.parametrize('make', [PlainBuffer, BufferCore, OwnBuffer])
@pytest.mark.parametrize('name', INSERTIONS)
def test_refusal_is_warned_of_where_it_is_inserted(make, name):
    assert_warns_at_its_line(INSERTIONS[name], make())


@pytest.mark.parametrize('name', MORE_INSERTIONS)
def test_refusal_beyond_tf2_is_warned_of_where_it_is_inserted(name):
    assert_warns_at_its_line(MORE_INSERTIONS[name], BufferCore())


@pytest.mark.parametrize('make', [
    fed, lambda: fed().snapshot(), watched], ids=['buffer', 'snapshot', 'with an observer'])
@pytest.mark.parametrize('name', LOOKUPS)
def test_stamps_in_another_unit_are_warned_of_where_they_are_looked_up(make, name):
    assert_warns_at_its_line(LOOKUPS[name], make())


def test_stamps_in_another_unit_are_warned_of_in_a_tree_of_a_file(tmp_path):
    fed().save(tmp_path / 'tree')
    assert_warns_at_its_line(LOOKUPS['lookup_many'], load(tmp_path / 'tree'))


def test_class_of_a_user_is_the_caller():
    def line_in(method):
        return method.__code__.co_firstlineno + 1

    with pytest.warns(UserWarning, match='cache_time') as caught:
        buffer = OwnBuffer(10)
    assert [(one.filename, one.lineno) for one in caught] == [
        (__file__, line_in(OwnBuffer.__init__))]
    with pytest.warns(TransformWarning) as caught:
        buffer.feed(NAN)
    assert [(one.filename, one.lineno) for one in caught] == [(__file__, line_in(OwnBuffer.feed))]


def test_without_a_line_of_a_user_the_warning_has_that_of_the_thread():
    with pytest.warns(TransformWarning) as caught:
        thread = threading.Thread(target=BufferCore().insert, args=('map', 'base', 1, NAN))
        thread.start()
        thread.join()
        with ThreadPoolExecutor(1) as pool:
            pool.submit(BufferCore().insert, 'map', 'base', 1, NAN).result()
    assert [one.filename.rpartition('/')[2] for one in caught] == ['threading.py', 'thread.py']


@pytest.mark.parametrize('frame', [{'__name__': 'rclpy.executors', '__file__': 'rclpy/x.py'},
                                   {'__name__': 'importlib._bootstrap'},
                                   {'__name__': 'tf2_ros.buffer', '__file__': str(
                                       house.PACKAGE / 'dropin/packages/tf2_ros/buffer.py')}])
def test_who_calls_back_or_imports_is_not_the_caller(frame):
    code = compile('def between(call): call()', frame.get('__file__', '<frozen>'), 'exec')
    exec(code, frame)
    with pytest.warns(UserWarning, match='odd') as caught:
        frame['between'](partial(warn, 'odd'))
    assert caught[0].filename == __file__


def test_script_and_notebook_are_callers():
    names = {'__name__': '__main__', 'warn': warn}  # neither has a package; a cell has no file
    with pytest.warns(UserWarning, match='odd') as caught:
        exec(compile("\nwarn('odd')", '<cell 3>', 'exec'), names)
    assert (caught[0].filename, caught[0].lineno) == ('<cell 3>', 2)


# --- once

def shown(calls):
    """Return the texts that Python shows by default, which are new at their lines."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('default')
        for call in calls:
            call()
    return [str(one.message) for one in caught]


def test_each_kind_is_shown_once_though_all_are_at_one_line():
    buffer = BufferCore()
    samples = [Sample('map', 'base', 1, NAN), Sample('map', '', 1, Pose())]
    texts = shown([lambda: buffer.insert_many(samples)] * 3)
    assert [text.partition(' (')[2][:3] for text in texts] == ['NaN', 'emp']


def test_python_shows_a_text_once_for_each_line():
    def in_a_loop():
        for _ in range(3):
            BufferCore(20)

    assert len(shown([in_a_loop, lambda: BufferCore(20)])) == 2


# --- no other place

def test_no_other_file_counts_frames():
    """Deprecated names warn their direct callers, so that this package uses none of them."""
    for path in {*house.files(), house.PACKAGE / '__init__.py'} - {
            house.PACKAGE / 'core/errors.py', house.PACKAGE / 'deprecation.py'}:
        for node in ast.walk(ast.parse(path.read_text())):
            assert not (isinstance(node, ast.Attribute) and ast.unparse(node) == 'warnings.warn')
